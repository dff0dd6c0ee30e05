"""The settings that the scenarios of all tasks share.

A role with several kinds is a Union. A scenario file names the kind by its YAML tag. Without a tag, the kind is the
kind in the extended scenario, or the first kind if no scenario is extended. Scenarios are frozen:
`BaseScenario.with_settings` returns a changed copy.
"""

import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

from drake_tracker.core.setting import replace_settings, setting
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.scenarios.tree import Value


@dataclass(frozen=True)
class Custom:
    """A custom part: an object that a class or function of the user returns.

    Attributes:
        call: class or function, as module.name.
        parameters: keyword arguments of the call.
        folder: folder of the module, relative to the scenario file. If it is empty, the module is searched for in the
            folder of the scenario file, in the current folder and among the installed packages.
        named_at: file and line in which a scenario file names the code, "mine.yaml line 3"; empty when the user named
            it on the command line or in Python. Filled in by `load_scenario`; it is not a setting.
        allowed: whether the user allows the code to run. Only code that a file names needs that, see
            `drake_tracker.scenarios.consent`.
    """

    call: str = setting("", "class or function that makes the part, as module.name")
    parameters: dict[str, float | bool | int | str] = setting({}, "keyword arguments of the call")
    folder: str = setting(
        "", "folder of the module; empty: the folder of the scenario, the current folder, or an installed package"
    )
    named_at: str = field(default="", compare=False, repr=False, kw_only=True)
    allowed: bool = field(default=True, compare=False, repr=False, kw_only=True)


@dataclass(frozen=True)
class BaseScenario:
    """The settings of every scenario.

    Attributes:
        task: name of the task.
        name: name of the scenario, filled in when it is loaded.
        description: one line for the list of scenarios.
        duration: simulated time after which the run ends [s].
        seed: seed of all random draws.
        time_step: step of the plant [s].
        origins: {key path: where its value was written}, filled in by `load_scenario`. It is not a setting.
    """

    COMMON: ClassVar[tuple[str, ...]] = ()
    """Key paths of the settings that people change most, which `drake-tracker list` shows."""
    LAG_KEY: ClassVar[str] = "vision.lag_cycles"
    """Key path of the lag of vision."""
    task: str = setting("", "name of the task")
    name: str = setting("", "name of the scenario; filled in when it is loaded")
    description: str = setting("", "one line for the list of scenarios")
    duration: float = setting(60.0, "simulated time after which the run ends", "s", (0.01, 36000.0))
    seed: int = setting(0, "seed of all random draws", "", (0, 2**32 - 1))
    time_step: float = setting(TIME_STEP, "step of the plant", "s", (0.0001, 0.01))
    origins: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False, kw_only=True)

    @property
    def lag(self) -> float:
        """Time from an image to the packet that is based on the image, without the link [s]."""
        return operator.attrgetter(self.LAG_KEY)(self) * VISION_PERIOD

    def with_settings(self, changes: Mapping[str, Any]) -> Self:
        """Returns a copy with some settings changed.

        The values are not checked here: `drake_tracker.tasks.validate` checks whether they are allowed, and the
        function that builds the diagram whether they can be built.

        Args:
            changes: {key path: value}, for example ``{"track.speed": 0.2, "seed": 3}``.

        Raises AttributeError when there is no such setting.
        """
        return replace_settings(self, changes)

    def where(self, key: str) -> str:
        """Returns where a setting got its value, to open an error message.

        For example "train.yaml line 12: track.speed", "--set track.speed=2: track.speed" or "track.speed (default)".
        """
        return f"{self.origins[key]}: {key}" if key in self.origins else f"{key} (default)"

    @classmethod
    def present(cls, tree: Value, notes: list[str]) -> Value:
        """Returns the tree of a scenario with settings of former versions translated into present settings.

        Args:
            tree: the tree, a mapping.
            notes: list to which one line is appended for each setting that has another name today.
        """
        return tree

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key path, what is required)."""
        return []

    def timing_problems(self, servo_period: float) -> list[tuple[str, str]]:
        """Returns the periods that are not a multiple of the plant's step, in the form of `problems`.

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
