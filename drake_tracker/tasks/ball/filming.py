"""Content of the video, the picture of the detector and the 3-D recording of a run of the ball."""

from dataclasses import replace
from enum import IntEnum
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.core.messages import CatchDiagnosis, predicted_points
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.grasp.ball.board_exit import BoardEdge
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.tasks.ball.setup import BallSetup
from drake_tracker.tasks.filming import FRAMES_PER_SECOND, PATH_MARKS, Film, Script, Snapshot, View
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
from drake_tracker.vision.centroid.frame_difference import DifferenceImages

SIDE = ""
"""Suffix of the ports of the single camera."""
PREDICTING = (CatchPhase.WAIT, CatchPhase.FOLLOW, CatchPhase.SETTLE, CatchPhase.CUP)
"""Phases in which a predicted path is drawn."""
VIDEO_MARKS = 11
"""Number of points with which the video marks a predicted path."""
SNAPSHOT_PERIOD = 0.2
"""Time between two evaluations of the detector's images [s]. A ball rolls for about two seconds."""
INTO_CUP = 0.08
"""Time after the crossing up to which the path is drawn [s]. Afterwards the ball is in the cup or was missed."""
WITHOUT_CROSSING = 1.0
"""Duration of a path that does not reach the edge [s]."""
BAR = 2.0
"""Half the length of the error bar at a predicted crossing, in standard deviations."""


def arrival_notes(phase: IntEnum, diagnosis: Any) -> tuple[str, str]:
    """Returns two notes for a frame of the video: when the ball arrives, and the uncertainty of the position.

    Args:
        phase: the present phase.
        diagnosis: a `CatchDiagnosis`.
    """
    if phase not in (CatchPhase.FOLLOW, CatchPhase.SETTLE) or not diagnosis.known:
        return "", ""
    return f"arrives in {max(diagnosis.time_left, 0.0):.2f} s", f"within {2e3 * diagnosis.std:.0f} mm (2 std)"


def ball_film(setup: BallSetup, hand_eye: HandEyeDiagram) -> Film:
    """Returns the content of the camera video of a run of the ball.

    Args:
        setup: the resolved scenario.
        hand_eye: the diagram of the run.
    """
    scenario, camera = setup.scenario, setup.camera
    predicted = PredictedPath(setup.edge)
    script = Script(
        phases=CatchPhase,
        predicting=PREDICTING,
        diagnosis=CatchDiagnosis,
        notes=arrival_notes,
        path=partial(predicted.path, count=VIDEO_MARKS),
        goal=predicted.goal,
    )
    return Film(
        title=scenario.name,
        subtitle=f"seed {scenario.seed}, board at {scenario.board.incline_deg:g} deg",
        polygons={SIDE: setup.search_window.polygon},
        image_size=(camera.width, camera.height),
        cameras={SIDE: replace(camera, X_CW=camera.X_CW @ setup.poses.X_WB.inverse().GetAsMatrix4())},
        offsets={SIDE: setup.window[:2]},
        lag=hand_eye.vision.lag,
        lag_cycles=hand_eye.vision.lag / VISION_PERIOD,
        script=script,
        goal="predicted crossing",
        every=round(1.0 / (FRAMES_PER_SECOND * VISION_PERIOD)),
        update_cycles=scenario.vision.update_cycles,
        image_latency=hand_eye.world.image_latency,
    )


def ball_view(setup: BallSetup) -> View:
    """Returns how the 3-D recording shows a run of the ball.

    Args:
        setup: the resolved scenario.
    """
    predicted = PredictedPath(setup.edge)
    return View(
        phases=PREDICTING,
        path=partial(predicted.path, count=PATH_MARKS),
        eye=(1.50, -1.75, 1.95),
        target=(0.58, 0.0, 0.56),
        fov_deg=36.0,
        floor=False,
    )


def ball_snapshot(detector: Any) -> Snapshot:
    """Returns when the images of the detector are kept: while the ball rolls, or before, if it never rolls."""
    cycles = getattr(detector, "stride", None)  # None: it compares with the empty board
    later = f"Image n + {Fraction(cycles, round(1.0 / VISION_PERIOD))} s" if cycles else "Image"
    titles = ("Image n" if cycles else "Reference image", later, "Thresholded difference")

    def draw(images: dict[str, Any], path: Path) -> None:
        if isinstance(images[SIDE], DifferenceImages):
            from drake_tracker.tasks.ball.board_figure import draw_difference_images  # Matplotlib is slow to load

            draw_difference_images(images[SIDE], titles, path)
        else:
            from drake_tracker.tasks.plots import draw_motion_images

            draw_motion_images(images, path)

    return Snapshot(sides=(SIDE,), phases=(CatchPhase.WAIT, CatchPhase.FOLLOW), period=SNAPSHOT_PERIOD, draw=draw)


class PredictedPath:
    """Points to draw for packets of predicted path on an inclined board.

    Args:
        edge: the bottom edge of the board, as the arm knows it.
    """

    def __init__(self, edge: BoardEdge) -> None:
        self._edge = edge

    def path(self, packet: np.ndarray, now: float, count: int) -> np.ndarray:
        """Returns points of the predicted path in W [m], shape (n, 3), from now until the ball is in the cup.

        Args:
            packet: vector of a valid `Prediction`.
            now: present time [s].
            count: number of points.

        Returns no points when the ball is already in the cup.
        """
        crossing = self._edge.crossing(packet)
        end = crossing.time + INTO_CUP if crossing is not None else now + WITHOUT_CROSSING
        return predicted_points(packet, np.linspace(now, end, count)) if end > now else np.zeros((0, 3))

    def goal(self, packet: np.ndarray, now: float) -> np.ndarray:
        """Returns the predicted crossing of the edge and the ends of its error bar in W [m], shape (3, 3).

        Args:
            packet: vector of a valid `Prediction`.
            now: present time [s].

        Returns no points when no crossing is predicted, or when it is past.
        """
        crossing = self._edge.crossing(packet)
        if crossing is None or crossing.time + INTO_CUP < now:
            return np.zeros((0, 3))
        reach = BAR * crossing.std * self._edge.R_WB[:, 0]
        return crossing.p_WQ + np.array([np.zeros(3), -reach, reach])


def ball_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `BALL_STRIPS` ([mm], the last one [s]), None for an unknown value.

    Args:
        inputs: values of a run; ``report`` is a `CatchDiagnosis`.
    """
    expected = inputs.report
    known = expected.known and expected.time_left >= 0.0
    tracking = horizontal_distance(inputs.p_WT, (expected.x, expected.y)) if known else None
    time_left = expected.time_left if known else None
    return rounded((tracking, prediction_error(inputs), *arc_lengths(inputs), time_left))


BALL_STRIPS = StripChart(
    strips=(
        Strip("Tracking error", "cup to the predicted crossing", "mm", 200.0),
        PREDICTION_STRIP,
        Strip("Arc length", "between points: measured, filtered", "mm", 80.0, 1, (("", FAINT), ("", BRIGHT))),
        Strip("Time left", "until the ball is over the cup", "s", 2.0, 2),
    ),
    span=10.0,
    values=ball_strip_values,
    state_port="truth_ball_state",
    report_port="diagnosis",
    report_view=CatchDiagnosis,
)
"""Tracking error, prediction error, arc length and time left."""
