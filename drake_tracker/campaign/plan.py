"""The plan of a campaign: all its trials, its identity, and the function with which a worker runs a trial."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from drake_tracker import __version__
from drake_tracker.campaign.grid import GridCell, make_cells, yaml_text
from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.tasks import load_scenario

MOST_TRIALS = 100_000
"""Greatest number of seeds in each cell."""
VISIONS = {"measured": "vision=!Measured {}"}
"""The override for each choice of ``vision``."""

TrialKey = tuple[tuple[tuple[str, str], ...], int]
"""Settings and seed of a trial, which identify it within its campaign."""


class Trial(NamedTuple):
    """One job of a worker.

    Attributes:
        settings: the varied settings {key path: YAML text}.
        scenario: the scenario with these settings and with this trial's seed.
    """

    settings: dict[str, str]
    scenario: Any

    @property
    def key(self) -> TrialKey:
        """Identifies the trial within its campaign."""
        return key_of(self.settings, self.scenario.seed)


def key_of(settings: Mapping[str, str], seed: int) -> TrialKey:
    """Returns the identity of a trial within its campaign.

    Args:
        settings: the varied settings {key path: YAML text}.
        seed: of the trial.
    """
    return tuple(settings.items()), seed


@dataclass(frozen=True)
class CampaignPlan:
    """A campaign: the same seeds in each of its cells.

    Attributes:
        spec: the scenario, as given.
        overrides: texts "key.path=value" for every trial, as given.
        vary: {key path: values, as YAML texts}.
        trials: number of seeds in each cell.
        first_seed: the first seed; the others count up from it.
        cells: all combinations of the varied settings.
    """

    spec: str
    overrides: tuple[str, ...]
    vary: dict[str, list[str]]
    trials: int
    first_seed: int
    cells: tuple[GridCell, ...]

    def __len__(self) -> int:
        return self.trials * len(self.cells)

    def jobs(self) -> Iterator[Trial]:
        """Yields every `Trial`, seed by seed, so that a half-finished campaign covers all cells."""
        for seed in range(self.first_seed, self.first_seed + self.trials):
            for cell in self.cells:
                yield Trial(cell.settings, cell.scenario.with_settings({"seed": seed}))

    def identity(self) -> dict[str, Any]:
        """Returns, as a dict for JSON, the values that must not change when a campaign is continued."""
        settings = "\n".join(repr(cell.scenario) for cell in self.cells)
        return {
            "scenario": self.spec,
            "overrides": list(self.overrides),
            "vary": self.vary,
            "first_seed": self.first_seed,
            "drake_tracker": __version__,
            "settings_sha256": hashlib.sha256(settings.encode()).hexdigest(),
        }


def make_plan(
    spec: str,
    trials: int,
    vary: Mapping[str, Sequence[Any]] | None = None,
    overrides: Sequence[str] = (),
    first_seed: int = 0,
    vision: str | None = None,
    allow_code: bool | None = None,
) -> CampaignPlan:
    """Returns the checked `CampaignPlan` of a campaign, before anything runs.

    Raises DrakeTrackerError, with one line for each error.

    Args:
        spec: a scenario, as `load_scenario` takes it.
        trials: number of seeds in each cell.
        vary: {key path: values}; each value is a YAML text or a plain Python value.
        overrides: texts "key.path=value" for every trial.
        first_seed: the first seed; the others count up from it.
        vision: "measured" renders no images.
        allow_code: whether code that the scenario file names may run, as for `load_scenario`. The workers are given
            this consent with each trial.
    """
    if trials < 1:
        raise DrakeTrackerError(f"--trials {trials}: must be a whole number from 1")
    origins = {}
    if vision is not None:
        if vision not in VISIONS:
            raise DrakeTrackerError(f"--vision {vision}: must be one of {', '.join(VISIONS)}")
        overrides = (VISIONS[vision], *overrides)
        origins[VISIONS[vision]] = f"--vision {vision}"
    if trials > MOST_TRIALS:
        raise DrakeTrackerError(f"--trials {trials}: at most {MOST_TRIALS} are allowed")
    texts = {key: [yaml_text(value) for value in values] for key, values in (vary or {}).items()}
    cells = make_cells(spec, overrides, texts, origins, allow_code)
    for option, seed in (("--first-seed", first_seed), ("the last seed", first_seed + trials - 1)):
        try:
            load_scenario(spec, seed=seed)
        except DrakeTrackerError as error:
            raise DrakeTrackerError(str(error).replace("--seed", option)) from None
    return CampaignPlan(spec, tuple(overrides), texts, trials, first_seed, tuple(cells))


class Lost(NamedTuple):
    """Stands in place of a result when a trial could not be completed, for a reason that is not the robot's.

    Attributes:
        reason: one line.
    """

    reason: str


def run_trial(trial: Trial) -> dict[str, Any] | Lost:
    """Runs a `plan.Trial`. Returns its line of the record (settings, seed and the run's summary), or `Lost`."""
    return run_line(trial.scenario, settings=trial.settings)


def run_line(scenario: Any, **named: Any) -> dict[str, Any] | Lost:
    """Runs a scenario. Returns its line of a record, or `Lost` when the machine failed.

    A run that ends with an exception counts as a failed run, and the exception is its reason.

    Args:
        scenario: of any task.
        named: further values of the line, which come first.
    """
    from drake_tracker.run.simulation import simulate  # here, because checking a campaign must not wait for Drake

    start = time.monotonic()
    try:
        summary = simulate(scenario)
    except (MachineError, MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    except (Exception, SystemExit) as error:  # one broken trial must not cost the others; Drake raises SystemExit
        text = " ".join(str(error).split())
        summary = {"scenario": scenario.name, "success": False, "failure_reason": f"{type(error).__name__}: {text}"}
    return {**named, "seed": scenario.seed, "wall_s": round(time.monotonic() - start, 3), **summary}
