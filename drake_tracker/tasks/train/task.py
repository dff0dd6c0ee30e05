"""The task of Allen et al. 1991: track a model train with two cameras, and grasp it while it moves."""

from collections.abc import Collection, Mapping
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System

from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import (
    GraspDiagnosis,
    HandCorrection,
    HandPoint,
    JawState,
    Regions,
    TrackPoints,
    Verdict,
    WristPoint,
)
from drake_tracker.core.timing import PROJECTOR_SLOT, SERVO_PERIOD, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram
from drake_tracker.diagrams.parts import link_of
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, during
from drake_tracker.tasks.filming import Closeup, Film, Snapshot, View
from drake_tracker.tasks.task import MOTION_PICTURE, CalibrationPlace, ReplayParts, Task
from drake_tracker.tasks.train.diagnosis.failure import activity
from drake_tracker.tasks.train.diagnosis.judged_train import about_target
from drake_tracker.tasks.train.diagram import add_controller, build, make_train_host, train_guard
from drake_tracker.tasks.train.episode import phase_spans, sighted
from drake_tracker.tasks.train.pictures.filming import (
    GRASP_PICTURE,
    TRAIN_SNAPSHOT,
    TRAIN_STRIPS,
    TRAIN_VIEW,
    train_closeup,
    train_film,
)
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import summarise
from drake_tracker.tasks.train.vision import object_vision
from drake_tracker.vision.triangulator_system import TriangulatorSystem

_FREE = (Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT)
_GRASPING = (Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE)
_ALWAYS_CHANGEABLE = ("estimator", "link", "guard", "servo")
_MM, _SECONDS, _PERCENT = (1e3, "mm", 1), (1.0, "s", 2), (100.0, "%", 1)


class TrainFreeMotion:
    """The time in which the train moves freely: until the jaws close on it.

    Args:
        scenario: the scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        spans: phases of the run.
    """

    def __init__(self, scenario: TrainScenario, log: Log) -> None:
        self.spans = phase_spans(log, scenario.time_step)

    def free(self, times: np.ndarray) -> np.ndarray:
        return during(self.spans, times, *_FREE)

    def tracked(self, times: np.ndarray) -> np.ndarray:
        return during(self.spans, times, Phase.TRACK)

    def observed(self, times: np.ndarray) -> np.ndarray:
        return sighted(self.spans, times)


class TrainTask(Task[TrainScenario]):
    """The task of the train."""

    name = "train"
    phases = Phase
    beside = (Phase.INTERCEPT, Phase.CLOSE)
    verdict = Verdict
    diagnosis = GraspDiagnosis
    centroids = ("centroid_left", "centroid_right")
    truth_signal = "truth_train_state"
    servo_period = SERVO_PERIOD
    time_step = TIME_STEP
    extra_signals = {  # noqa: RUF012
        "tracks": (VISION_PERIOD, TrackPoints.get_fields()),
        "regions_left": (VISION_PERIOD, Regions.get_fields()),
        "regions_right": (VISION_PERIOD, Regions.get_fields()),
        "wrist": (VISION_PERIOD, WristPoint.get_fields()),
        "jaws": (VISION_PERIOD, JawState.get_fields()),
        "hand_point": (VISION_PERIOD, HandPoint.get_fields()),
        "hand_correction": (VISION_PERIOD, HandCorrection.get_fields()),
        "truth_judged": (VISION_PERIOD, ("train",)),
    }
    pictures = {  # noqa: RUF012
        "tracking.png": "The track from above, the probability of success and errors over time, and phases.",
        GRASP_PICTURE: "The last half second before the contact: what the cameras saw, what vision found there, the "
        "predicted place of the contact, and the pads of the jaws.",
    }
    titles = ("The train was not lifted", "The train was lifted")
    outcomes = ("not lifted", "lifted")
    summary_rows = (
        ("time_to_grasp_s", "time to grasp", _SECONDS),
        ("attempts", "attempts", (1.0, "", 0)),
        ("lift_height_m", "lift height", _MM),
        ("hold_s", "held for", _SECONDS),
        ("prediction_rms_m", "prediction error, rms", _MM),
        ("prediction_p95_m", "prediction error, 95th percentile", _MM),
        ("position_rms_m", "present position error, rms", _MM),
        ("triangulation_rms_m", "triangulation error, rms", _MM),
        ("triangulation_jitter_m", "triangulation jitter", _MM),
        ("vision_valid_fraction", "cycles with a valid point while the arm uses vision", _PERCENT),
        ("closing_onset_error_s", "closing, relative to the last possible instant", (1e3, "ms", 0)),
    )
    result_rows = (
        ("success", "success", ""),
        ("failure_reason", "reason", ""),
        ("attempts", "attempts", ""),
        ("time_to_grasp_s", "time to grasp", "s"),
        ("lift_height_m", "lift height", "m"),
        ("hold_s", "held", "s"),
        ("prediction_rms_m", "prediction rms", "m"),
        ("real_time_factor", "real-time factor", ""),
    )
    changeable = {  # noqa: RUF012
        "points": _ALWAYS_CHANGEABLE,
        "centroids": (*_ALWAYS_CHANGEABLE, "vision.work_volume", "cameras.calibration"),
        "images": (
            *_ALWAYS_CHANGEABLE,
            "vision.method.detector",
            "vision.lag_cycles",
            "vision.work_volume",
            "vision.outline",
            "cameras.calibration",
        ),
    }
    has_autopsy = True
    strips = TRAIN_STRIPS
    preparation = ""

    def uses_cameras(self, scenario: TrainScenario) -> bool:
        return not resolve(scenario).measured

    def files_of(self, scenario: TrainScenario) -> tuple[str, ...]:
        # No run promises a picture of the grasp, since there may be no attempt.
        missing = (GRASP_PICTURE, MOTION_PICTURE) if resolve(scenario).several else (GRASP_PICTURE,)
        return tuple(name for name in super().files_of(scenario) if name not in missing)

    def build(self, scenario: TrainScenario, initialisation: Any, decision: System | None = None) -> HandEyeDiagram:
        return build(resolve(scenario), decision=decision)

    def add_controller(
        self, scenario: TrainScenario, initialisation: None, builder: DiagramBuilder, host: System | None = None
    ) -> Controller:
        return add_controller(resolve(scenario), builder, host=host)

    def ended(self, verdict: Any) -> str | None:
        if verdict.taken:
            return "the train was lifted"
        return "the train was thrown off its track" if verdict.derailed else None

    def activity(self, phase: IntEnum, diagnosis: Any, reason: str = "") -> str:
        return activity(Phase(phase), Gate(int(diagnosis.gate)), reason)

    def p_success(self, diagnosis: Any) -> float | None:
        return float(diagnosis.p_success) if Phase(int(diagnosis.phase)) in _GRASPING else None

    def summarise(
        self, scenario: TrainScenario, hand_eye: HandEyeDiagram, log: Log, simulated: float, interrupted: bool
    ) -> dict[str, Any]:
        return summarise(resolve(scenario), log, simulated, interrupted)

    def judged_log(self, scenario: TrainScenario, log: Log) -> Log:
        return about_target(resolve(scenario), log)

    def free_motion(self, scenario: TrainScenario, log: Log) -> TrainFreeMotion:
        return TrainFreeMotion(scenario, log)

    def draw(
        self, scenario: TrainScenario, hand_eye: HandEyeDiagram, log: Log, summary: Mapping[str, Any], folder: Path
    ) -> None:
        from drake_tracker.tasks.train.pictures.figures import draw_tracking  # Matplotlib is slow to load

        draw_tracking(resolve(scenario), about_target(resolve(scenario), log), summary, folder / "tracking.png")

    def subtitle(self, scenario: TrainScenario) -> str:
        return f"seed {scenario.seed}, {scenario.track.speed:g} m/s"

    def film(self, scenario: TrainScenario, hand_eye: HandEyeDiagram) -> Film:
        return train_film(resolve(scenario), hand_eye, self.subtitle(scenario))

    def closeup(self, scenario: TrainScenario, hand_eye: HandEyeDiagram) -> Closeup:
        return train_closeup(resolve(scenario), hand_eye)

    def snapshot(self, scenario: TrainScenario) -> Snapshot:
        return TRAIN_SNAPSHOT

    def view(self, scenario: TrainScenario, hand_eye: HandEyeDiagram) -> View:
        return TRAIN_VIEW

    def success_sentence(self, summary: Mapping[str, Any]) -> str | None:
        if summary.get("time_to_grasp_s") is None:
            return None
        attempts = summary.get("attempts")
        which = "at the first attempt" if attempts == 1 else f"at attempt {attempts}"
        name = (summary.get("tracking") or {}).get("lifted_object") or "train"
        what = "The train" if name == "train" else f"The target, {name},"
        return f"{what} was lifted {which}, {summary['time_to_grasp_s']:.1f} s after the start."

    def signal_offset(self, name: str, time_step: float) -> float:
        if name == "tracks":
            return vision_slot(PROJECTOR_SLOT, time_step)
        return super().signal_offset(name, time_step)

    def replay_sources(self, scenario: TrainScenario, start: str) -> tuple[str, ...]:
        if not resolve(scenario).several:
            return super().replay_sources(scenario, start)
        if start == "centroids":
            raise DrakeTrackerError(
                "a vision that tracks several objects cannot be replayed from centroids, which belong to the target "
                "only; use --from points for the recorded tracks, or --from images"
            )
        return ("tracks",) if start == "points" else resolve(scenario).arm_signals

    def replay_start(self, scenario: TrainScenario, logged: Collection[str]) -> str:
        return "points" if resolve(scenario).several else super().replay_start(scenario, logged)

    def changeable_settings(self, recorded: TrainScenario, scenario: TrainScenario, start: str) -> tuple[str, ...]:
        settings = super().changeable_settings(recorded, scenario, start)
        if start != "images" or not resolve(recorded).several:
            return settings
        return (*settings, "vision.method")

    def calibration_place(self, scenario: TrainScenario) -> CalibrationPlace:
        return CalibrationPlace(scenario.table_height, scenario.vision.work_volume, "vision.work_volume")

    def rebuild(self, scenario: TrainScenario, recorded: TrainScenario, start: str, folder: Path) -> ReplayParts:
        setup, seen = resolve(scenario), resolve(recorded)
        vision: System | None = None
        images: dict[str, tuple[int, int]] = {}
        if start == "images":
            vision = object_vision(setup, seen.windows)
            images = seen.image_sizes
        elif start == "centroids":
            cameras = [setup.cameras[side] for side in SIDES]
            vision = TriangulatorSystem(*cameras, work_volume=scenario.vision.work_volume)
            vision.set_name("triangulator")
        link = link_of(scenario, setup.faults)
        return ReplayParts(vision, images, make_train_host(setup), link, train_guard(setup))


TASK = TrainTask()
