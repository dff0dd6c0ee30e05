"""Content of the video, the pictures of motion detector and grasp, and the 3-D recording of a run of the train."""

from collections.abc import Callable, Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.core.constants import SIDES
from drake_tracker.core.messages import GraspDiagnosis, JawState, predicted_points
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, has_tracks
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log
from drake_tracker.tasks.filming import Closeup, Film, Frame, Script, Snapshot, View
from drake_tracker.tasks.strips import (
    BRIGHT,
    FAINT,
    PREDICTION_STRIP,
    Strip,
    StripChart,
    StripInputs,
    arc_lengths,
    horizontal_distance,
    prediction_error,
    rounded,
)
from drake_tracker.tasks.train.closing import LATEST
from drake_tracker.tasks.train.pictures.grasp_instants import SPAN
from drake_tracker.tasks.train.setup import TrainSetup

PREDICTING = (Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE)
"""Phases in which a predicted path is drawn. In the others the hand holds the train, or returns."""
_GATE_WORDS = {
    Gate.OPEN: "open",
    Gate.SETTLING: "settling",
    Gate.FLIPPING: "jaws turning over",
    Gate.STALE: "no fresh packet",
    Gate.NO_MEMORY: "first lap here",
    Gate.PREDICTIONS_FAILED: "failed here a lap ago",
    Gate.SUCCESS_UNLIKELY: "success not likely",
    Gate.SURPRISES: "path surprised before",
    Gate.OUT_OF_REACH: "out of reach",
}
GRASP_PICTURE = "grasp.png"
"""Name of the picture of the last grasp, which only a run with images and an attempt leaves."""
_EARLY = 0.2
"""Time before the beginning of the closing at which the hand may already touch the train [s]."""
_VIDEO_TIMES = np.arange(0.0, 1.01, 0.1)
_RECORDING_TIMES = np.arange(0.0, 1.21, 0.15)
"""Times ahead of the present at which the predicted path is marked [s]."""


def attempt_notes(phase: IntEnum, diagnosis: Any) -> tuple[str, str]:
    """Returns two notes for a frame of the video: the number of the attempt, and why the gate is closed.

    Args:
        phase: the present phase.
        diagnosis: a `GraspDiagnosis`.
    """
    attempts, gate = int(diagnosis.attempts), Gate(int(diagnosis.gate))
    words = _GATE_WORDS.get(gate, "") if phase == Phase.TRACK else ""
    if gate == Gate.SUCCESS_UNLIKELY:
        words = words and f"{words}: {100.0 * diagnosis.p_success:.0f} %"
    return f"attempt {attempts}" if attempts else "", f"gate: {words}" if words else ""


def _path_at(ahead: np.ndarray) -> Callable[[np.ndarray, float], np.ndarray]:
    """Returns a `PathFunction` with the points of the path at given times ahead of the present [s], shape (n,)."""
    return lambda packet, now: predicted_points(packet, now + ahead)


def _draw_snapshot(images: dict[str, Any], path: Path) -> None:
    from drake_tracker.tasks.plots import draw_motion_images  # Matplotlib is slow to load

    draw_motion_images(images, path)


TRAIN_SCRIPT = Script(
    phases=Phase,
    predicting=PREDICTING,
    diagnosis=GraspDiagnosis,
    notes=attempt_notes,
    path=_path_at(_VIDEO_TIMES),
)
TRAIN_VIEW = View(phases=PREDICTING, path=_path_at(_RECORDING_TIMES))
TRAIN_SNAPSHOT = Snapshot(sides=SIDES, phases=(Phase.TRACK,), period=1.0, draw=_draw_snapshot)


def train_closeup(setup: TrainSetup, hand_eye: HandEyeDiagram) -> Closeup:
    """Returns which images of a run of the train are kept for the picture of the grasp.

    They begin early enough for a contact that comes before the jaws close.

    Args:
        setup: of a scenario with ``vision: !Rendered``.
        hand_eye: the diagram of the run.
    """
    cameras, offsets = setup.cameras, _offsets(hand_eye)

    def draw(frames: Sequence[Frame], log: Log, path: Path) -> None:
        from drake_tracker.tasks.train.pictures.grasp_figure import draw_grasp  # Matplotlib is slow to load

        draw_grasp(setup, cameras, offsets, frames, log, path)

    return Closeup(
        file=GRASP_PICTURE,
        sides=SIDES,
        phase=Phase.CLOSE,
        before=SPAN + _EARLY,
        after=touch_delay(setup.grasp) + LATEST,
        image_latency=hand_eye.world.image_latency,
        draw=draw,
    )


def _offsets(hand_eye: HandEyeDiagram) -> dict[str, tuple[int, int]]:
    """Returns {side: (u0, v0) of the first pixel of its images in the full image [px]}."""
    return {side: hand_eye.world.cameras[f"camera_{side}"].window[:2] for side in SIDES}


def train_film(setup: TrainSetup, hand_eye: HandEyeDiagram, subtitle: str) -> Film:
    """Returns the content of the camera video of a run of the train.

    Args:
        setup: of a scenario with ``vision: !Rendered``.
        hand_eye: the diagram of the run.
        subtitle: second line of text.
    """
    config = setup.scenario.cameras
    cameras = setup.cameras
    windows = setup.search_windows
    return Film(
        title=setup.scenario.name,
        subtitle=subtitle,
        polygons={side: windows[side].polygon for side in SIDES},
        image_size=(config.width, config.height),
        cameras=cameras,
        offsets=_offsets(hand_eye),
        lag=setup.scenario.vision.lag_cycles * VISION_PERIOD,
        lag_cycles=setup.scenario.vision.lag_cycles,
        every=2 - setup.update_cycles % 2,  # an image that vision does not look at is rendered only for the video
        update_cycles=setup.update_cycles,
        script=TRAIN_SCRIPT,
        image_latency=hand_eye.world.image_latency,
        several=has_tracks(hand_eye),
    )


def train_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `TRAIN_STRIPS` [mm], None for an unknown value.

    Args:
        inputs: values of a run; ``report`` is a `JawState`.
    """
    tracking = horizontal_distance(inputs.p_WT, inputs.p_WQ)
    jaws = (1e3 * inputs.command.jaw_width, 1e3 * inputs.report.width)
    return rounded((tracking, prediction_error(inputs), *arc_lengths(inputs), *jaws))


TRAIN_STRIPS = StripChart(
    strips=(
        Strip("Tracking error", "hand to train, horizontal", "mm", 60.0),
        PREDICTION_STRIP,
        Strip("Arc length", "between points: measured, filtered", "mm", 10.0, 2, (("", FAINT), ("", BRIGHT))),
        Strip("Jaw width", "commanded, measured", "mm", 100.0, 1, (("", FAINT), ("", BRIGHT))),
    ),
    span=20.0,
    values=train_strip_values,
    state_port="truth_train_state",
    report_port="jaws",
    report_view=JawState,
)
"""Tracking error, prediction error, arc length and jaw width."""
