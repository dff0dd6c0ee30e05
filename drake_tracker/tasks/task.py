"""The interface of a task: everything that a run of it does in its own way.

A task is a folder of this package with a scenario (settings), a class that satisfies `Task`, and one line in
`drake_tracker.tasks.registry`. The applications (`run`, `replay`, `live`, `report`, `campaign`) know tasks only through
this interface.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from pydrake.systems.framework import System

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import ArmCommand, Centroid, Filtered, Prediction, ServoTarget, ToolStatus, TrackPoint
from drake_tracker.core.timing import GRASP_SLOT, TIME_STEP, VISION_PERIOD, servo_slot
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.tasks.episode import Log, PhaseSpan, phase_spans
from drake_tracker.tasks.filming import Film, Snapshot, View
from drake_tracker.tasks.strips import StripChart

Found = TypeVar("Found")
AskForWindows = Callable[[list[np.ndarray], Any], Sequence[Sequence[float]]]
"""Asks a person for windows in images: (RGB images, the scenario's ``operator``) -> windows, or none."""
SummaryRow = tuple[str, str, tuple[float, str, int]]
"""(key of the summary, label, (factor, unit, decimals))."""
RUN_FILES = ("summary.json", "log.npz", "scenario.yaml", "recording.html", "cameras.mp4", "motion.png")
"""What a run of every task leaves."""
CAMERA_FILES = ("cameras.mp4", "motion.png")
"""What only a run with rendered cameras leaves."""
BODY_STATE = ("qw", "qx", "qy", "qz", "x", "y", "z", "wx", "wy", "wz", "vx", "vy", "vz")
"""Fields of a free body's state: quaternion, position [m], angular [rad/s] and translational [m/s] velocity, in W."""


class FreeMotion(Protocol):
    """When the object of a run moved freely, which is when predictions of it are judged.

    Attributes:
        spans: phases of the run.
    """

    spans: tuple[PhaseSpan, ...]

    def free(self, times: np.ndarray) -> np.ndarray:
        """Returns at which times (n,) [s] the object moved freely, shape (n,), bool."""

    def tracked(self, times: np.ndarray) -> np.ndarray:
        """Returns at which times (n,) [s] the present position is judged, shape (n,), bool."""

    def observed(self, times: np.ndarray) -> np.ndarray:
        """Returns at which times (n,) [s] predictions made from vision are judged, shape (n,), bool."""


@dataclass(frozen=True, eq=False)
class ReplayParts:
    """What a replay runs again in front of link and servo.

    Attributes:
        vision: System from what is replayed to ``point``, or None when points are replayed.
        images: {camera: (width, height) [px]} of the recorded images that ``vision`` reads.
        host: the estimator as a System.
    """

    vision: System | None
    images: Mapping[str, tuple[int, int]]
    host: EstimatorSystem


class Task(Protocol):
    """One task, such as the train. Classes that inherit from it get the parts that are the same for every task.

    Attributes:
        name: the scenarios' ``task``.
        phases: enumeration of the phases in `ArmCommand`.
        verdict: named view of the ``truth_verdict`` port, the judge's findings.
        diagnosis: named view of the ``diagnosis`` port.
        centroids: names of the centroid signals.
        truth_signal: signal with the object's true state.
        servo_period: period of the arm's set-points [s].
        time_step: default step of the plant [s].
        extra_signals: {name: (period [s], fields)} of signals that only this task has.
        pictures: {name: caption} of the pictures that `draw` leaves, the main one first.
        titles: sentences for a failed and for a successful run.
        outcomes: words for the same: ("not lifted", "lifted").
        summary_rows: rows of the summary on the page of a run.
        result_rows: (key, label, unit) of the summary that the command prints.
        changeable: {start of a replay: settings that have an effect in it}.
        has_autopsy: whether `drake_tracker.report.autopsy` can explain its failures.
        strips: strips of the live view.
        preparation: what `initialise` does, in one line for the user, or "" when there is nothing to do.
    """

    name: str
    phases: type[IntEnum]
    verdict: Any
    diagnosis: Any
    centroids: tuple[str, ...]
    truth_signal: str
    servo_period: float
    time_step: float
    extra_signals: Mapping[str, tuple[float, Sequence[str]]]
    pictures: Mapping[str, str]
    titles: tuple[str, str]
    outcomes: tuple[str, str]
    summary_rows: tuple[SummaryRow, ...]
    result_rows: tuple[tuple[str, str, str], ...]
    changeable: Mapping[str, tuple[str, ...]]
    has_autopsy: bool
    strips: StripChart
    preparation: str

    # Building

    def uses_cameras(self, scenario: Any) -> bool:
        """Returns whether a run renders images."""

    def initialise(self, scenario: Any, ask_for_windows: AskForWindows | None = None) -> Any:
        """Returns what must be found out before the diagram can be built, None when there is nothing. May simulate."""
        return None

    def resolved(self, scenario: Any, initialisation: Any) -> Any:
        """Returns the scenario with what a person answered during the initialisation, for the record of a run."""
        return scenario

    def save_initialisation(self, initialisation: Any, folder: Path) -> None:
        """Writes the result of `initialise` to the directory of a run, so that `rebuild` can read it."""
        return

    def build(self, scenario: Any, initialisation: Any) -> HandEyeDiagram:
        """Returns the diagram of a scenario. It never simulates."""

    # Judging

    def ended(self, verdict: Any) -> str | None:
        """Returns why a run is over, None while it is not.

        Args:
            verdict: a view of the type ``verdict``.
        """

    def summarise(
        self, scenario: Any, hand_eye: HandEyeDiagram, log: Log, simulated: float, interrupted: bool
    ) -> dict[str, Any]:
        """Returns the summary of a run as a dict of numbers, texts and None (where there is nothing to say).

        Args:
            scenario: the run's scenario.
            hand_eye: the run's diagram.
            log: {name: Signal}.
            simulated: time at which the run ended [s].
            interrupted: whether the user ended it.
        """

    def free_motion(self, scenario: Any, log: Log) -> FreeMotion:
        """Returns when the object of a run moved freely."""

    # Showing

    def draw(self, scenario: Any, hand_eye: HandEyeDiagram, log: Log, summary: Mapping[str, Any], folder: Path) -> None:
        """Writes the ``pictures`` of a run to its directory."""

    def subtitle(self, scenario: Any) -> str:
        """Returns one line about a run, for video and live view."""

    def film(self, scenario: Any, hand_eye: HandEyeDiagram) -> Film:
        """Returns what the camera video shows; only for a run with cameras."""

    def snapshot(self, scenario: Any) -> Snapshot:
        """Returns when the detector's images are kept; only for a run with cameras."""

    def view(self, scenario: Any, hand_eye: HandEyeDiagram) -> View:
        """Returns how the 3-D recording shows a run."""

    def success_sentence(self, summary: Mapping[str, Any]) -> str | None:
        """Returns a sentence about a successful run, from its summary."""

    # Replaying

    def rebuild(self, scenario: Any, recorded: Any, start: str, folder: Path) -> ReplayParts:
        """Returns the parts of a replay.

        Args:
            scenario: the recorded scenario with the changes of the replay.
            recorded: the recorded scenario.
            start: "images", "centroids" or "points".
            folder: directory of the run.
        """

    # The same for every task

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that a run leaves."""
        return (*RUN_FILES[:-1], *self.pictures, RUN_FILES[-1])

    def signals(self, num_joints: int = 6) -> dict[str, tuple[float, Sequence[str]]]:
        """Returns the output ports of the diagram that are logged: {name: (sampling period [s], fields)}.

        A sample at time t is what the port showed before the updates of that instant. Signals named ``truth_*`` come
        from the simulator; the loop does not read them. Measured vision has no centroids.
        """
        q, v, u = ([f"{letter}{i + 1}" for i in range(num_joints)] for letter in "qvu")
        return {
            **dict.fromkeys(self.centroids, (VISION_PERIOD, Centroid.get_fields())),
            "point": (VISION_PERIOD, TrackPoint.get_fields()),
            "filtered": (VISION_PERIOD, Filtered.get_fields()),
            "prediction": (VISION_PERIOD, Prediction.get_fields()),
            "delivered": (VISION_PERIOD, Prediction.get_fields()),
            "target": (self.servo_period, ServoTarget.get_fields()),
            "command": (self.servo_period, ArmCommand.get_fields()),
            "status": (self.servo_period, ToolStatus.get_fields()),
            "diagnosis": (self.servo_period, self.diagnosis.get_fields()),
            "q_commanded": (self.servo_period, q),
            "arm_state": (TIME_STEP, q + v),
            "arm_effort": (TIME_STEP, u),
            **self.extra_signals,
            self.truth_signal: (VISION_PERIOD, BODY_STATE),
            "truth_verdict": (VISION_PERIOD, self.verdict.get_fields()),
        }

    def signal_offset(self, name: str, time_step: float) -> float:
        """Returns the offset [s] at which the System that makes a signal is updated.

        Args:
            name: of the signal.
            time_step: of the plant [s].
        """
        return servo_slot(GRASP_SLOT, time_step, self.servo_period) if name == "command" else 0.0

    def phase_spans(self, log: Log, time_step: float) -> tuple[PhaseSpan, ...]:
        """Returns the phases of a run, in order."""
        return phase_spans(log, self.phases, time_step)


def required(initialisation: Found | None, task: str) -> Found:
    """Returns what the initialisation found. Raises DrakeTrackerError when a task was not initialised."""
    if initialisation is None:
        raise DrakeTrackerError(
            f"{task}: the diagram needs what is found before the run: make_diagram(scenario, initialise(scenario))"
        )
    return initialisation
