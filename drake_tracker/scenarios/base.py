"""What the scenarios of all tasks share.

A role that has several kinds is a Union; a scenario file names the kind by its YAML tag, and the first one is the
default. Scenarios are frozen: `BaseScenario.with_settings` returns a changed copy.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from drake_tracker.core.setting import replace_settings, setting
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD


@dataclass(frozen=True)
class Custom:
    """A part of your own: what a class or a function of yours returns."""

    call: str = setting("", "class or function that makes the part, as module.name")
    parameters: dict[str, float | bool | int | str] = setting({}, "keyword arguments of the call")
    folder: str = setting("", "folder of the module; empty: the scenario's, the current one, or an installed package")


@dataclass(frozen=True)
class BaseScenario:
    """What every scenario has.

    Attributes:
        origins: {key path: where its value was written}, filled in by `load_scenario`; it is no setting.
    """

    task: str = setting("", "the task")
    name: str = setting("", "the scenario's name; filled in when it is loaded")
    description: str = setting("", "one line for the list of scenarios")
    duration: float = setting(60.0, "simulated time after which the run ends", "s", (0.01, 36000.0))
    seed: int = setting(0, "seed of every random draw", "", (0, 2**32 - 1))
    time_step: float = setting(TIME_STEP, "step of the plant", "s", (0.0001, 0.01))
    origins: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False, kw_only=True)

    def with_settings(self, changes: Mapping[str, Any]) -> Self:
        """Returns a copy with settings changed, by key path: ``{"track.speed": 0.2, "seed": 3}``.

        Raises AttributeError when there is no such setting. Whether the values are allowed is checked by
        `drake_tracker.tasks.validate`, and whether the scenario can be built when it is.
        """
        return replace_settings(self, changes)

    def where(self, key: str) -> str:
        """Returns where a setting got its value, for an error message: "train.yaml line 12: track.speed", or
        "--set track.speed=2: track.speed", or "track.speed (default)".
        """
        return f"{self.origins[key]}: {key}" if key in self.origins else f"{key} (default)"

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key, what is wrong and what to do)."""
        return []

    def timing_problems(self, servo_period: float) -> list[tuple[str, str]]:
        """Returns, as `problems` does, what the plant's step does not divide.

        Args:
            servo_period: period of the arm's set-points [s].
        """
        found = []
        periods = ((VISION_PERIOD, "image period 1/60 s"), (servo_period, f"servo period {servo_period:g} s"))
        for period, what in periods:
            steps = period / self.time_step
            if not math.isclose(steps, round(steps), rel_tol=1e-6):
                default = type(self)().time_step
                example = f"1/{round(1.0 / default)} ({default!r})"
                found.append(("time_step", f"must divide the {what}; {example} does"))
        return found


def find_module(part: Custom, folders: Iterable[Path]) -> str:
    """Returns the first of ``folders`` that holds the module of a `Custom`, absolute; "" when none does: it may be
    installed.
    """
    top = part.call.partition(".")[0]
    for folder in folders:
        if (folder / f"{top}.py").is_file() or (folder / top / "__init__.py").is_file():
            return str(Path(folder).resolve())
    return ""
