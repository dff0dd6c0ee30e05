"""The tasks, each registered by one line here.

Importing this module loads the scenarios only; the class of a task, and Drake with it, is loaded when it is first used.
"""

import importlib
import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.train.scenario import TrainScenario

if TYPE_CHECKING:
    from drake_tracker.diagrams.hand_eye import HandEyeDiagram
    from drake_tracker.tasks.task import AskForWindows, Task


@dataclass(frozen=True)
class Entry:
    """One task.

    Attributes:
        scenario: its dataclass of settings; the scenario files of the task are in the folder of that module.
        module: module with the constant ``TASK``, an instance of its `Task` class.
    """

    scenario: type[BaseScenario]
    module: str

    @property
    def folder(self) -> Path:
        """Folder of the task, with its scenario files."""
        return Path(inspect.getfile(self.scenario)).parent


TASKS = {
    "train": Entry(TrainScenario, "drake_tracker.tasks.train.task"),
    "ball": Entry(BallScenario, "drake_tracker.tasks.ball.task"),
}
"""Each task by its name, which is also that of the file with its scenarios."""


def task_named(name: str) -> "Task":
    """Returns the `Task` of a name. Raises DrakeTrackerError when there is none."""
    if name not in TASKS:
        raise DrakeTrackerError(f"task is {name!r}; the tasks are {', '.join(TASKS)}")
    return importlib.import_module(TASKS[name].module).TASK


def task_of(scenario: BaseScenario) -> "Task":
    """Returns the `Task` of a scenario. Raises DrakeTrackerError when there is none of its name."""
    return task_named(scenario.task)


def initialise(scenario: BaseScenario, ask_for_windows: "AskForWindows | None" = None) -> Any:
    """Returns what must be known before the diagram of a scenario can be built; None for a task without such a step.

    For the ball the camera reads the circles of the board, and the arm touches its marks: this simulates for about
    fifteen seconds. Pass the result to `make_diagram`.

    Args:
        scenario: a scenario of any task; it is not changed.
        ask_for_windows: asks a person for windows around the circles, when the scenario has none: (RGB images,
            ``scenario.operator``) -> windows (u0, v0, width, height) [px], or none to have the circles found.

    Raises DrakeTrackerError when the initialisation fails.
    """
    return task_of(scenario).initialise(scenario, ask_for_windows)


def make_diagram(scenario: BaseScenario, initialisation: Any = None) -> "HandEyeDiagram":
    """Returns the `HandEyeDiagram` of a scenario of any task. Building never simulates.

    Args:
        scenario: a scenario, for example from `load_scenario`.
        initialisation: what `initialise` returned; the train needs none.

    Raises DrakeTrackerError, in one line, when the scenario cannot be built or the initialisation is missing.
    """
    return task_of(scenario).build(scenario, initialisation)


def require_task(scenario: BaseScenario, name: str, why: str) -> None:
    """Raises DrakeTrackerError when a scenario is of another task than the one that is needed.

    Args:
        scenario: the scenario.
        name: of the task that is needed.
        why: the reason, a clause for the message.
    """
    if scenario.task != name:
        raise DrakeTrackerError(f"{scenario.name or scenario.task}: this needs a scenario of the {name}: {why}")
