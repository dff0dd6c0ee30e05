"""The task of the conveyor: pick parts from a moving belt and place them in trays."""

from collections.abc import Collection, Mapping
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import (
    ArmCommand,
    BeltEstimate,
    EncoderReading,
    EncoderReport,
    JawState,
    LimiterReport,
    PacketReport,
    PartTracks,
    PickDiagnosis,
    PickOrder,
    PickVerdict,
    Prediction,
    ServoTarget,
    ToolStatus,
    packet_target,
)
from drake_tracker.core.timing import GRASP_SLOT, SERVO_PERIOD, TIME_STEP, TRANSFORM_SLOT, VISION_PERIOD, servo_slot
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.grasp.gate import Gate
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.conveyor.diagram import (
    add_controller,
    build,
    conveyor_guard,
    conveyor_host,
    conveyor_link,
    image_vision,
)
from drake_tracker.tasks.conveyor.filming import CONVEYOR_STRIPS, CONVEYOR_VIEW, PREDICTING, conveyor_film
from drake_tracker.tasks.conveyor.overview import CONVEYOR_OVERVIEW
from drake_tracker.tasks.conveyor.part_history import tracks_of
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.conveyor.setup import HIGHEST, resolve
from drake_tracker.tasks.conveyor.summary import ENOUGH, summarise_conveyor
from drake_tracker.tasks.episode import Log, during, phase_spans
from drake_tracker.tasks.filming import Film, Snapshot, View
from drake_tracker.tasks.plots import LONG
from drake_tracker.tasks.task import BODY_STATE, MOTION_PICTURE, CalibrationPlace, ReplayParts, Task
from drake_tracker.vision.parts.part_vision_diagram import PartVisionDiagram

_REPORTS, _ARM = ("diagnosis", "status"), ("arm_state", "jaws")
"""Signals of the arm that the host reads, and signals that vision reads."""
_HOST = ("estimator", "dispatch", "eligibility", "window", "cycle", "link", "guard", "servo")
"""Settings that have an effect in every replay."""
_COUNT, _MM = (1.0, "", 0), (1e3, "mm", 1)
_WAITING = {
    Gate.SETTLING: "the hand settles",
    Gate.FLIPPING: "the jaws turn over",
    Gate.STALE: "no recent packet",
    Gate.SUCCESS_UNLIKELY: "a pick would probably fail",
}
FOLLOWING = (PickPhase.TRACK, PickPhase.INTERCEPT)
"""Phases in which the hand follows a part that lies on the belt."""


class PickFreeMotion:
    """The time in which the part that the hand follows lies on the belt.

    While the arm turns to another part, a prediction may be about one and the true path about the other. It is judged
    only once the part has been the same for the whole time from the oldest packet that predicts this instant.

    Args:
        scenario: the scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        spans: phases of the run.
    """

    def __init__(self, scenario: BaseScenario, log: Log) -> None:
        self.spans = phase_spans(log, PickPhase, scenario.time_step)
        times = log["delivered"].times
        part = target_parts(log, times, len(log["truth_fates"].names))
        changes = times[1:][np.diff(part) != 0]
        self._changed = np.concatenate([[-np.inf], changes])

    def free(self, times: np.ndarray) -> np.ndarray:
        since = times - self._changed[np.searchsorted(self._changed, times, side="right") - 1]
        return during(self.spans, times, *FOLLOWING) & (since > LONG)

    def tracked(self, times: np.ndarray) -> np.ndarray:
        return self.free(times)

    def observed(self, times: np.ndarray) -> np.ndarray:
        return np.ones(len(times), dtype=bool)


class ConveyorTask(Task[ConveyorScenario]):
    """The task of the conveyor."""

    name = "conveyor"
    phases = PickPhase
    verdict = PickVerdict
    diagnosis = PickDiagnosis
    centroids = ()
    truth_signal = "truth_part_states"
    servo_period = SERVO_PERIOD
    time_step = TIME_STEP
    extra_signals = {  # noqa: RUF012
        "parts": (VISION_PERIOD, PartTracks.get_fields()),
        "belt": (VISION_PERIOD, BeltEstimate.get_fields()),
        "order": (VISION_PERIOD, PickOrder.get_fields()),
        "jaws": (VISION_PERIOD, JawState.get_fields()),
        "encoder": (TIME_STEP, EncoderReading.get_fields()),
        "encoder_report": (VISION_PERIOD, EncoderReport.get_fields()),
    }
    body_signals = {  # noqa: RUF012
        "truth_part_states": (VISION_PERIOD, BODY_STATE),
        "truth_fates": (VISION_PERIOD, ("fate",)),
    }
    pictures = {  # noqa: RUF012
        "conveyor.png": "Each part on its way along the belt, where it was picked, and what became of it; the phases "
        "of the hand; the trays at the end; and the picks over time.",
    }
    titles = (
        f"Fewer than {ENOUGH:.0%} of the parts that could be picked were placed",
        f"At least {ENOUGH:.0%} of the parts that could be picked were placed",
    )
    outcomes = ("too few placed", "parts placed")
    summary_rows = (
        ("arrived", "parts that arrived", _COUNT),
        ("could_be_picked", "parts that could be picked", _COUNT),
        ("picked", "picked", _COUNT),
        ("placed", "placed", _COUNT),
        ("missed", "missed", _COUNT),
        ("dropped", "dropped", _COUNT),
        ("misplaced", "misplaced", _COUNT),
        ("doubles", "picked together with another part", _COUNT),
        ("picks_per_minute", "picks a minute", (1.0, "", 1)),
        ("share_of_clairvoyant", "share of the picks of an arm that knows all arrivals", (100.0, "%", 0)),
        ("encoder_unused_s", "time without a usable encoder", (1.0, "s", 1)),
        ("placement_rms_m", "position error in the cells, rms", _MM),
        ("placement_turn_rms_rad", "direction error in the cells, rms", (180.0 / np.pi, "°", 1)),
    )
    result_rows = (
        ("success", "success", ""),
        ("failure_reason", "reason", ""),
        ("arrived", "arrived", ""),
        ("could_be_picked", "could be picked", ""),
        ("picked", "picked", ""),
        ("placed", "placed", ""),
        ("misplaced", "misplaced", ""),
        ("dropped", "dropped", ""),
        ("picks_per_minute", "picks a minute", ""),
        ("share_of_clairvoyant", "of the bound", "%"),
        ("placement_rms_m", "placement rms", "m"),
        ("real_time_factor", "real-time factor", ""),
    )
    changeable = {  # noqa: RUF012
        "points": _HOST,
        "centroids": _HOST,
        "images": (*_HOST, "vision.parts", "vision.lag_cycles", "cameras.calibration"),
    }
    replayed = ("parts", "belt", "order", "prediction", "delivered", "target")
    has_autopsy = False
    strips = CONVEYOR_STRIPS
    overview = CONVEYOR_OVERVIEW
    preparation = ""

    def uses_cameras(self, scenario: ConveyorScenario) -> bool:
        return not resolve(scenario).measured

    def files_of(self, scenario: ConveyorScenario) -> tuple[str, ...]:
        return tuple(name for name in super().files_of(scenario) if name != MOTION_PICTURE)

    def calibration_place(self, scenario: ConveyorScenario) -> CalibrationPlace:
        (x0, y0), (x1, y1) = resolve(scenario).seen_belt
        low = scenario.belt.height
        return CalibrationPlace(low, ((x0, y0, low), (x1, y1, low + HIGHEST)), "belt")

    def build(self, scenario: ConveyorScenario, initialisation: Any, decision: System | None = None) -> HandEyeDiagram:
        return build(resolve(scenario), decision)

    def add_controller(
        self, scenario: ConveyorScenario, initialisation: Any, builder: DiagramBuilder, host: System | None = None
    ) -> Controller:
        return add_controller(resolve(scenario), builder, host=host)

    def ended(self, verdict: Any) -> str | None:
        settled = verdict.placed + verdict.missed + verdict.dropped
        over = verdict.arrived > 0 and verdict.coming == 0 and settled == verdict.arrived
        return "all parts were placed, missed or dropped" if over else None

    def summarise(
        self, scenario: ConveyorScenario, hand_eye: HandEyeDiagram, log: Log, simulated: float, interrupted: bool
    ) -> dict[str, Any]:
        return summarise_conveyor(resolve(scenario), hand_eye.world.arrivals, log, simulated, interrupted)

    def judged_log(self, scenario: ConveyorScenario, log: Log) -> Log:
        return with_target(log, self.truth_signal)

    def free_motion(self, scenario: ConveyorScenario, log: Log) -> PickFreeMotion:
        return PickFreeMotion(scenario, log)

    def draw(
        self, scenario: ConveyorScenario, hand_eye: HandEyeDiagram, log: Log, summary: Mapping[str, Any], folder: Path
    ) -> None:
        from drake_tracker.tasks.conveyor.figures import draw_conveyor  # Matplotlib is slow to load

        draw_conveyor(resolve(scenario), hand_eye.world.arrivals, log, summary, folder / "conveyor.png")

    def subtitle(self, scenario: ConveyorScenario) -> str:
        belt = scenario.belt
        return f"seed {scenario.seed}, {scenario.arrivals.rate:g} parts a minute, belt at {belt.speed:g} m/s"

    def film(self, scenario: ConveyorScenario, hand_eye: HandEyeDiagram) -> Film:
        return conveyor_film(resolve(scenario), hand_eye)

    def snapshot(self, scenario: ConveyorScenario) -> Snapshot:
        raise DrakeTrackerError(f"{scenario.name or scenario.task}: the conveyor has no motion detector")

    def view(self, scenario: ConveyorScenario, hand_eye: HandEyeDiagram) -> View:
        return CONVEYOR_VIEW

    def success_sentence(self, summary: Mapping[str, Any]) -> str | None:
        if summary.get("could_be_picked") is None or summary.get("placed_of_these") is None:
            return None
        sentence = (
            f"{summary['placed_of_these']} of the {summary['could_be_picked']} parts that could be picked were placed"
        )
        if summary.get("placement_rms_m") is not None:
            sentence += f", {1e3 * summary['placement_rms_m']:.1f} mm rms from the middles of their cells"
        return f"{sentence}."

    def replay_sources(self, scenario: ConveyorScenario, start: str) -> tuple[str, ...]:
        if start == "centroids":
            raise DrakeTrackerError(
                "a run of the conveyor has no centroids; use --from points for the recorded parts, or --from images"
            )
        host = (*_REPORTS, *(("encoder",) if scenario.belt.encoder else ()))
        if start == "points":
            return ("parts", *host)
        _ = resolve(scenario).rendered  # raises without images
        return (*host, *_ARM)

    def replay_start(self, scenario: ConveyorScenario, logged: Collection[str]) -> str:
        return "points"

    def signal_offset(self, name: str, time_step: float) -> float:
        slots = {"diagnosis": GRASP_SLOT, "status": TRANSFORM_SLOT}
        if name in slots:
            return servo_slot(slots[name], time_step, self.servo_period)
        return super().signal_offset(name, time_step)

    def rebuild(self, scenario: ConveyorScenario, recorded: ConveyorScenario, start: str, folder: Path) -> ReplayParts:
        vision: PartVisionDiagram | None = None
        images: dict[str, tuple[int, int]] = {}
        setup = resolve(scenario)
        if start == "images":
            windows = resolve(recorded).windows
            vision = image_vision(setup, windows)
            images = {f"camera_{side}": window[2:] for side, window in windows.items()}
        return ReplayParts(vision, images, conveyor_host(setup), conveyor_link(setup), conveyor_guard(setup))

    def signals(self, num_joints: int = 6) -> dict[str, tuple[float, Any]]:
        q, v, u = ([f"{letter}{i + 1}" for i in range(num_joints)] for letter in "qvu")
        return {
            "prediction": (VISION_PERIOD, Prediction.get_fields()),
            "delivered": (VISION_PERIOD, Prediction.get_fields()),
            "packet_report": (SERVO_PERIOD, PacketReport.get_fields()),
            "target": (SERVO_PERIOD, ServoTarget.get_fields()),
            "command": (SERVO_PERIOD, ArmCommand.get_fields()),
            "status": (SERVO_PERIOD, ToolStatus.get_fields()),
            "diagnosis": (SERVO_PERIOD, PickDiagnosis.get_fields()),
            "q_commanded": (SERVO_PERIOD, q),
            "limiter_report": (SERVO_PERIOD, LimiterReport.get_fields()),
            "arm_state": (TIME_STEP, q + v),
            "arm_effort": (TIME_STEP, u),
            **self.extra_signals,
            "truth_verdict": (VISION_PERIOD, PickVerdict.get_fields()),
        }

    def activity(self, phase: IntEnum, diagnosis: Any, reason: str = "") -> str:
        words = phase.name.lower()
        if phase == PickPhase.WAIT:
            words = "wait: no part to pick"
        elif phase == PickPhase.TRACK and Gate(int(diagnosis.gate)) in _WAITING:
            words = f"track: {_WAITING[Gate(int(diagnosis.gate))]}"
        return f"{words} ({int(diagnosis.placed)} placed)"

    def p_success(self, diagnosis: Any) -> float | None:
        return float(diagnosis.p_success) if PickPhase(int(diagnosis.phase)) in PREDICTING else None


TASK = ConveyorTask()


def with_target(log: Log, truth_signal: str) -> dict[str, Signal]:
    """Returns a log in which the true state is the state of the part that the arm has a packet about.

    Args:
        log: {name: Signal} of the run.
        truth_signal: name of the signal with the states of all parts, which is replaced: then its fields are x and y in
            W [m], NaN while there is no packet.
    """
    states = log[truth_signal]
    part = target_parts(log, states.times, len(log["truth_fates"].names))
    places = np.stack([states.view(f"x_{k}", f"y_{k}") for k in range(len(log["truth_fates"].names))], axis=1)
    xy = np.where(part[:, None] >= 0, places[np.arange(len(part)), np.maximum(part, 0)], np.nan)
    return {**log, truth_signal: Signal(states.times, xy, ("x", "y"))}


def target_parts(log: Log, times: np.ndarray, count: int) -> np.ndarray:
    """Returns which part the newest packet of the arm describes at times, from 0, -1 for none, shape (n,).

    Args:
        log: {name: Signal} of the run.
        times: (n,) [s].
        count: number of parts.
    """
    part_of = {number: k for k, numbers in enumerate(tracks_of(log, count)) for number in numbers}
    packets = log["delivered"]
    found = [part_of.get(packet_target(seq), -1) if valid else -1 for seq, valid in packets.view("seq", "valid")]
    return np.array(found)[np.clip(np.searchsorted(packets.times, times, side="right") - 1, 0, None)]
