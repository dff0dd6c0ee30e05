"""The interface of a task: everything in a run that depends on the task.

A task is a subpackage with a scenario (its settings) and a class that inherits from `Task`, registered in
`drake_tracker.tasks.registry`. The applications (`run`, `replay`, `live`, `report`, `campaign`) use tasks only through
this interface.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System

from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import (
    ArmCommand,
    Centroid,
    Filtered,
    LimiterReport,
    PacketReport,
    Prediction,
    ServoTarget,
    ToolStatus,
    TrackPoint,
)
from drake_tracker.core.timing import GRASP_SLOT, TIME_STEP, VISION_PERIOD, servo_slot
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.episode import Log, PhaseSpan, phase_spans
from drake_tracker.tasks.filming import Closeup, Film, Snapshot, View
from drake_tracker.tasks.strips import Overview, StripChart

Found = TypeVar("Found")
Scenario = TypeVar("Scenario", bound=BaseScenario)
AskForWindows = Callable[[list[np.ndarray], Any], Sequence[Sequence[float]]]
"""Asks a person for windows in images: (RGB images, the scenario's ``operator``) -> windows (u0, v0, width, height)
[px], or an empty sequence."""
SummaryRow = tuple[str, str, tuple[float, str, int]]
"""(key of the summary, label, (factor, unit, decimals))."""
RUN_FILES = ("summary.json", "log.npz", "scenario.yaml", "recording.html", "cameras.mp4", "motion.png")
"""Files that a run of every task leaves."""
MOTION_PICTURE = RUN_FILES[-1]
"""Name of the picture of the motion detector, which a vision that tracks several objects does not have."""
CAMERA_FILES = ("cameras.mp4", MOTION_PICTURE)
"""Files that only a run with rendered images leaves."""
BODY_STATE = ("qw", "qx", "qy", "qz", "x", "y", "z", "wx", "wy", "wz", "vx", "vy", "vz")
"""Fields of a free body's state in W: quaternion, position [m], angular [rad/s] and translational [m/s] velocity."""


class CalibrationPlace(NamedTuple):
    """Where the cameras of a scenario are calibrated.

    Attributes:
        height: z_W of the plane on which the chessboard lies [m].
        volume: lowest and highest corner (3,) in W of the box in which the cameras measure [m].
        volume_setting: name of the setting that determines the box.
    """

    height: float
    volume: Sequence[Sequence[float]]
    volume_setting: str


class FreeMotion(Protocol):
    """The time in which the object of a run moved freely, in which predictions are judged.

    Attributes:
        spans: phases of the run.
    """

    spans: tuple[PhaseSpan, ...]

    def free(self, times: np.ndarray) -> np.ndarray:
        """Returns at which of the times (n,) [s] the object moved freely, shape (n,), bool."""
        ...

    def tracked(self, times: np.ndarray) -> np.ndarray:
        """Returns at which of the times (n,) [s] the present position is judged, shape (n,), bool."""
        ...

    def observed(self, times: np.ndarray) -> np.ndarray:
        """Returns at which of the times (n,) [s] predictions based on vision are judged, shape (n,), bool."""
        ...


@dataclass(frozen=True, eq=False)
class ReplayParts:
    """The parts that a replay runs again, except the servo.

    Attributes:
        vision: System with the replayed signals as inputs and the output ``point``, ``tracks`` or ``parts``; None when
            these are replayed.
        images: {camera: (width, height) [px]} of the recorded images that ``vision`` reads.
        host: the estimator, the bank of estimators, or the host of the conveyor, as a System.
        link: the link as a System.
        guard: decides which packets the arm follows.
    """

    vision: System | None
    images: Mapping[str, tuple[int, int]]
    host: System
    link: System
    guard: PacketGuard


class Task(Protocol[Scenario]):
    """One task, such as the train. The methods with a body are the same for every task and are inherited.

    Attributes:
        name: name of the task, the setting ``task`` of its scenarios.
        phases: enumeration of the phases in `ArmCommand`.
        beside: phases in which the hand is beside the object: a run that is over still waits for their end.
        verdict: named view of the ``truth_verdict`` port, the judge's findings.
        diagnosis: named view of the ``diagnosis`` port.
        centroids: names of the centroid signals.
        truth_signal: name of the signal with the object's true state.
        servo_period: period of the arm's set-points [s].
        time_step: default step of the plant [s].
        extra_signals: {name: (sampling period [s], fields)} of the signals that only this task has.
        body_signals: the same for signals with all these fields for each of several bodies, as many as a run has. The
            names of the fields in the log end with the number of the body, from 0: ``x_0``.
        pictures: {file name: caption} of the pictures that `draw` and the `Closeup` write, the main one first.
        titles: a sentence for a failed and one for a successful run.
        outcomes: words for a failed and a successful run: ("not lifted", "lifted").
        summary_rows: rows of the summary on the page of a run.
        result_rows: (key, label, unit) of the entries of the summary that the command prints.
        changeable: {start of a replay: settings that have an effect in it}.
        replayed: signals that a replay needs to compare with; the first one has the times of vision.
        has_autopsy: whether `drake_tracker.report.failure_diagnosis` can explain failures of this task.
        strips: strips of the live view.
        overview: what the live view draws from above; None: nothing.
        preparation: what `initialise` does, in one line for the user; "" when there is no initialisation.
    """

    name: str
    phases: type[IntEnum]
    beside: tuple[IntEnum, ...] = ()
    verdict: Any
    diagnosis: Any
    centroids: tuple[str, ...]
    truth_signal: str
    servo_period: float
    time_step: float
    extra_signals: Mapping[str, tuple[float, Sequence[str]]]
    body_signals: Mapping[str, tuple[float, Sequence[str]]] = MappingProxyType({})
    pictures: Mapping[str, str]
    titles: tuple[str, str]
    outcomes: tuple[str, str]
    summary_rows: tuple[SummaryRow, ...]
    result_rows: tuple[tuple[str, str, str], ...]
    changeable: Mapping[str, tuple[str, ...]]
    replayed: tuple[str, ...] = ("point", "filtered", "prediction", "delivered", "target")
    has_autopsy: bool
    strips: StripChart
    overview: Overview | None = None
    preparation: str

    # Building

    def uses_cameras(self, scenario: Scenario) -> bool:
        """Returns whether a run of the scenario renders images."""
        ...

    def initialise(self, scenario: Scenario, ask_for_windows: AskForWindows | None = None) -> Any:
        """Returns the results that the diagram needs, None for a task without initialisation. May simulate.

        Args:
            scenario: the scenario.
            ask_for_windows: asks a person for windows in images, or None.
        """
        return None

    def resolved(self, scenario: Scenario, initialisation: Any) -> Scenario:
        """Returns the scenario with the answers that a person gave during the initialisation.

        Args:
            scenario: the scenario before the initialisation.
            initialisation: the return value of `initialise`.
        """
        return scenario

    def save_initialisation(self, initialisation: Any, folder: Path) -> None:
        """Writes the result of the initialisation to the directory of a run, where `rebuild` reads it.

        Args:
            initialisation: the return value of `initialise`.
            folder: directory of the run.
        """
        return

    def build(self, scenario: Scenario, initialisation: Any, decision: System | None = None) -> HandEyeDiagram:
        """Returns the diagram of a scenario. Does not simulate.

        Args:
            scenario: the scenario.
            initialisation: the return value of `initialise`.
            decision: replaces the System that decides on the motion of the hand, see `ArmDiagram`.

        Raises DrakeTrackerError when the scenario cannot be built.
        """
        ...

    def add_controller(
        self, scenario: Scenario, initialisation: Any, builder: DiagramBuilder, host: System | None = None
    ) -> Controller:
        """Adds the controller of a scenario to a diagram, without world and vision. ``host`` replaces its host.

        Raises DrakeTrackerError when a part of the controller cannot be made.
        """
        ...

    # Judging

    def ended(self, verdict: Any) -> str | None:
        """Returns why a run is over, None while it is not.

        Args:
            verdict: the judge's findings, of the type ``self.verdict``.
        """
        ...

    def summarise(
        self, scenario: Scenario, hand_eye: HandEyeDiagram, log: Log, simulated: float, interrupted: bool
    ) -> dict[str, Any]:
        """Returns the summary of a run, a dict of numbers, texts and None (where a value does not exist).

        Args:
            scenario: the scenario of the run.
            hand_eye: the diagram of the run.
            log: {name: Signal} of the run.
            simulated: time at which the run ended [s].
            interrupted: whether the user ended the run.
        """
        ...

    def judged_log(self, scenario: Scenario, log: Log) -> Log:
        """Returns the log of a run in which ``truth_signal`` is the state of the target.

        Args:
            scenario: the scenario of the run.
            log: {name: Signal} of the run.
        """
        return log

    def free_motion(self, scenario: Scenario, log: Log) -> FreeMotion:
        """Returns the time in which the object of a run moved freely.

        Args:
            scenario: the scenario of the run.
            log: {name: Signal} of the run.
        """
        ...

    # Showing

    def draw(
        self, scenario: Scenario, hand_eye: HandEyeDiagram, log: Log, summary: Mapping[str, Any], folder: Path
    ) -> None:
        """Writes the ``pictures`` of a run.

        Args:
            scenario: the scenario of the run.
            hand_eye: the diagram of the run.
            log: {name: Signal} of the run.
            summary: the return value of `summarise`.
            folder: directory of the run.
        """
        ...

    def subtitle(self, scenario: Scenario) -> str:
        """Returns one line about a run, for the video and the live view."""
        ...

    def film(self, scenario: Scenario, hand_eye: HandEyeDiagram) -> Film:
        """Returns the content of the camera video; only for a run that renders images.

        Args:
            scenario: the scenario of the run.
            hand_eye: the diagram of the run.
        """
        ...

    def snapshot(self, scenario: Scenario) -> Snapshot:
        """Returns when the images of the motion detector are kept; only for a run that renders images."""
        ...

    def closeup(self, scenario: Scenario, hand_eye: HandEyeDiagram) -> Closeup | None:
        """Returns which images are kept for a picture of the grasp, None for a task without such a picture.

        It is asked for only in a run that renders images.

        Args:
            scenario: the scenario.
            hand_eye: the diagram of the run.
        """
        return None

    def view(self, scenario: Scenario, hand_eye: HandEyeDiagram) -> View:
        """Returns how the 3-D recording shows a run.

        Args:
            scenario: the scenario of the run.
            hand_eye: the diagram of the run.
        """
        ...

    def success_sentence(self, summary: Mapping[str, Any]) -> str | None:
        """Returns a sentence about a successful run from its summary, None when an entry is missing."""
        ...

    # Replaying

    def replay_sources(self, scenario: Scenario, start: str) -> tuple[str, ...]:
        """Returns the names of the logged signals with which a replay begins.

        Args:
            scenario: the recorded scenario with the changes of the replay.
            start: where the replay begins: "images", "centroids" or "points".

        Raises DrakeTrackerError when the scenario has no signals of this kind.
        """
        return {"images": (), "centroids": self.centroids, "points": ("point",)}[start]

    def replay_start(self, scenario: Scenario, logged: Collection[str]) -> str:
        """Returns where a replay begins unless the user decides: at the centroids, or else at the points.

        Args:
            scenario: the recorded scenario.
            logged: names of the signals of the run.
        """
        return "centroids" if all(name in logged for name in self.centroids) else "points"

    def changeable_settings(self, recorded: Scenario, scenario: Scenario, start: str) -> tuple[str, ...]:
        """Returns the settings that have an effect in a replay.

        Args:
            recorded: the recorded scenario.
            scenario: the same scenario with the changes of the replay.
            start: where the replay begins: "images", "centroids" or "points".
        """
        return self.changeable[start]

    def rebuild(self, scenario: Scenario, recorded: Scenario, start: str, folder: Path) -> ReplayParts:
        """Returns the parts that a replay runs again.

        Args:
            scenario: the recorded scenario with the changes of the replay.
            recorded: the recorded scenario.
            start: where the replay begins: "images", "centroids" or "points".
            folder: directory of the run.
        """
        ...

    def calibration_place(self, scenario: Scenario) -> CalibrationPlace | None:
        """Returns where the fixed cameras of a scenario are calibrated, None for a task without such cameras."""
        return None

    # The same for every task

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that a run leaves, in the order in which they are listed."""
        return (*RUN_FILES[:-1], *self.pictures, RUN_FILES[-1])

    def files_of(self, scenario: Scenario) -> tuple[str, ...]:
        """Returns the names of the files that a run of a scenario leaves, as ``files``.

        Args:
            scenario: the scenario of the run.
        """
        if self.uses_cameras(scenario):
            return self.files
        return tuple(name for name in self.files if name not in CAMERA_FILES)

    def signals(self, num_joints: int = 6) -> dict[str, tuple[float, Sequence[str]]]:
        """Returns the output ports of the diagram that are logged: {name: (sampling period [s], fields)}.

        A sample at time t is the value of the port before the updates at that instant. Signals named ``truth_*`` are
        ground truth from the simulator, which the loop does not read. With measured vision there are no centroids.
        A diagram need not have all of them.

        Args:
            num_joints: number of joints of the arm.
        """
        q, v, u = ([f"{letter}{i + 1}" for i in range(num_joints)] for letter in "qvu")
        return {
            **dict.fromkeys(self.centroids, (VISION_PERIOD, Centroid.get_fields())),
            "point": (VISION_PERIOD, TrackPoint.get_fields()),
            "filtered": (VISION_PERIOD, Filtered.get_fields()),
            "prediction": (VISION_PERIOD, Prediction.get_fields()),
            "delivered": (VISION_PERIOD, Prediction.get_fields()),
            "packet_report": (self.servo_period, PacketReport.get_fields()),
            "target": (self.servo_period, ServoTarget.get_fields()),
            "command": (self.servo_period, ArmCommand.get_fields()),
            "status": (self.servo_period, ToolStatus.get_fields()),
            "diagnosis": (self.servo_period, self.diagnosis.get_fields()),
            "q_commanded": (self.servo_period, q),
            "limiter_report": (self.servo_period, LimiterReport.get_fields()),
            "arm_state": (TIME_STEP, q + v),
            "arm_effort": (TIME_STEP, u),
            **self.extra_signals,
            self.truth_signal: (VISION_PERIOD, BODY_STATE),
            "truth_verdict": (VISION_PERIOD, self.verdict.get_fields()),
        }

    def signal_offset(self, name: str, time_step: float) -> float:
        """Returns the offset [s] at which the System that makes a signal is updated.

        Args:
            name: name of the signal.
            time_step: the plant's step [s].
        """
        return servo_slot(GRASP_SLOT, time_step, self.servo_period) if name == "command" else 0.0

    def activity(self, phase: IntEnum, diagnosis: Any, reason: str = "") -> str:
        """Returns the activity of the arm for the progress line: the phase and, after a colon, the reason for waiting.

        Args:
            phase: one of ``phases``.
            diagnosis: value of the ``diagnosis`` port, of the type ``self.diagnosis``.
            reason: why vision outputs no point of the target, "" when it does or does not say.
        """
        return phase.name.lower()

    def p_success(self, diagnosis: Any) -> float | None:
        """Returns the probability that a grasp would succeed, None while the task does not estimate it.

        Args:
            diagnosis: value of the ``diagnosis`` port, of the type ``self.diagnosis``.
        """
        return None

    def phase_spans(self, log: Log, time_step: float) -> tuple[PhaseSpan, ...]:
        """Returns the phases of a run, in order.

        Args:
            log: {name: Signal} of the run.
            time_step: the plant's step [s].
        """
        return phase_spans(log, self.phases, time_step)


def required(initialisation: Found | None, task: str) -> Found:
    """Returns the result of an initialisation. Raises DrakeTrackerError when it is None.

    Args:
        initialisation: the return value of `initialise`, or None.
        task: name of the task, for the message.
    """
    if initialisation is None:
        raise DrakeTrackerError(
            f"{task}: the diagram needs the result of the initialisation: make_diagram(scenario, initialise(scenario))"
        )
    return initialisation
