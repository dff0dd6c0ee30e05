"""What a campaign is to do: every trial, and what tells one campaign from another."""

import hashlib
from dataclasses import dataclass
from typing import Any, NamedTuple

from drake_tracker import __version__
from drake_tracker.campaign.grid import make_cells, yaml_text
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks import load_scenario

VISIONS = {"measured": "vision=!Measured {}"}
"""The override for each choice of ``vision``."""


class Trial(NamedTuple):
    """A job of a worker: the varied settings {key path: YAML text}, and the scenario with this trial's seed."""

    settings: dict
    scenario: Any

    @property
    def key(self):
        """What no other trial of the campaign has."""
        return key_of(self.settings, self.scenario.seed)


def key_of(settings, seed):
    """Returns what tells a trial from all others of its campaign."""
    return tuple(settings.items()), seed


@dataclass(frozen=True)
class Plan:
    """A campaign: ``trials`` seeds from ``first_seed`` on in each of the ``cells``.

    spec, overrides, vary: as given. cells: a tuple of `grid.Cell`.
    """

    spec: str
    overrides: tuple
    vary: dict
    trials: int
    first_seed: int
    cells: tuple

    def __len__(self):
        return self.trials * len(self.cells)

    def jobs(self):
        """Yields every `Trial`, seed by seed, so that a campaign half done covers all cells."""
        for seed in range(self.first_seed, self.first_seed + self.trials):
            for cell in self.cells:
                yield Trial(cell.settings, cell.scenario.with_settings({"seed": seed}))

    def identity(self):
        """Returns, as a dict for JSON, what must be the same when a campaign goes on."""
        settings = "\n".join(repr(cell.scenario) for cell in self.cells)
        return {
            "scenario": self.spec,
            "overrides": list(self.overrides),
            "vary": self.vary,
            "first_seed": self.first_seed,
            "drake_tracker": __version__,
            "settings_sha256": hashlib.sha256(settings.encode()).hexdigest(),
        }


def make_plan(spec, trials, vary=None, overrides=(), first_seed=0, vision=None):
    """Returns the checked `Plan` of a campaign, before anything runs.

    Args:
      spec: a scenario, as `load_scenario` takes it. trials: seeds in each cell. vary: {key path: values}, each a YAML
      text or a plain value of Python. overrides: texts "key.path=value" for every trial. first_seed: seeds count up
      from it. vision: "measured" renders no images.

    Raises DrakeTrackerError, one line for each error.
    """
    if trials < 1:
        raise DrakeTrackerError(f"--trials {trials}: must be a whole number from 1")
    origins = {}
    if vision is not None:
        if vision not in VISIONS:
            raise DrakeTrackerError(f"--vision {vision}: must be one of {', '.join(VISIONS)}")
        overrides = (VISIONS[vision], *overrides)
        origins[VISIONS[vision]] = f"--vision {vision}"
    vary = {key: [yaml_text(value) for value in values] for key, values in (vary or {}).items()}
    cells = make_cells(spec, overrides, vary, origins)
    for option, seed in (("--first-seed", first_seed), ("the last seed", first_seed + trials - 1)):
        try:
            load_scenario(spec, seed=seed)
        except DrakeTrackerError as error:
            raise DrakeTrackerError(str(error).replace("--seed", option)) from None
    return Plan(spec, tuple(overrides), vary, trials, first_seed, tuple(cells))
