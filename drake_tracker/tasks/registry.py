"""The registry of the tasks. A new task is registered here, and only here.

Importing this module loads the scenarios' dataclasses only. The class of a task, and Drake with it, is loaded at its
first use.
"""

import importlib
import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.train.scenario import TrainScenario

if TYPE_CHECKING:
    from drake_tracker.diagrams.hand_eye import HandEyeDiagram
    from drake_tracker.tasks.task import AskForWindows, Task


@dataclass(frozen=True)
class Entry:
    """One registered task.

    Attributes:
        scenario: dataclass of its settings. The scenario files of the task are in the folder of that module.
        module: name of the module with the constant ``TASK``, an instance of the task's class.
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
    "conveyor": Entry(ConveyorScenario, "drake_tracker.tasks.conveyor.task"),
}
"""{name of the task: its entry}. The file with the scenarios of a task has the same name."""


def task_named(name: str) -> "Task":
    """Returns the task with a given name. Raises DrakeTrackerError when there is none."""
    if name not in TASKS:
        raise DrakeTrackerError(f"there is no task {name!r}; allowed are {', '.join(TASKS)}")
    return importlib.import_module(TASKS[name].module).TASK


def task_of(scenario: BaseScenario) -> "Task":
    """Returns the task of a scenario. Raises DrakeTrackerError when there is no task with that name."""
    return task_named(scenario.task)


def initialise(scenario: BaseScenario, ask_for_windows: "AskForWindows | None" = None) -> Any:
    """Performs the initialisation of a task. The result is an argument of `make_diagram`.

    For the ball, the camera measures the circles of the board and the arm touches its marks, which simulates about
    15 s. The other tasks need no initialisation.

    Args:
        scenario: a scenario of any task; it is not changed.
        ask_for_windows: asks a person for windows around the circles if the scenario has none: (RGB images,
            ``scenario.operator``) -> windows (u0, v0, width, height) [px]. The circles are found automatically if the
            answer is empty, or if this is None.

    Returns what the initialisation found, None for a task without one.

    Raises DrakeTrackerError when the initialisation fails.
    """
    return task_of(scenario).initialise(scenario, ask_for_windows)


def make_diagram(scenario: BaseScenario, initialisation: Any = None) -> "HandEyeDiagram":
    """Returns the diagram of a scenario. Building it does not simulate.

    Args:
        scenario: a scenario of any task, for example from `load_scenario`.
        initialisation: the return value of `initialise`; None for a task without initialisation.

    Raises DrakeTrackerError when the scenario cannot be built, or the initialisation is missing.
    """
    return task_of(scenario).build(scenario, initialisation)


def require_task(scenario: BaseScenario, name: str, why: str) -> None:
    """Raises DrakeTrackerError when a scenario does not belong to a given task.

    Args:
        scenario: the scenario.
        name: name of the required task.
        why: the reason, a clause for the message.
    """
    if scenario.task != name:
        raise DrakeTrackerError(f"{scenario.name or scenario.task}: this needs a scenario of the {name}: {why}")
