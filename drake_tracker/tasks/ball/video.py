"""The video and the motion images of a run of the ball, with what `video` and `motion_snapshot` have for every task."""

from dataclasses import replace
from fractions import Fraction
from functools import partial

from drake_tracker.core.messages import CatchDiagnosis
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.catch_schema import CatchPhase
from drake_tracker.run.camera_video import FRAMES_PER_SECOND, Script, film
from drake_tracker.run.motion_snapshot import add_motion_snapshot
from drake_tracker.run.scene import PATH_MARKS, View
from drake_tracker.run.video_page import VideoPage
from drake_tracker.tasks.ball.diagram import board_sight, known_edge
from drake_tracker.tasks.ball.difference_figure import draw_difference_images
from drake_tracker.tasks.ball.foresight import BoardForesight
from drake_tracker.tasks.style import CATCH_PHASES_THAT_PREDICT
from drake_tracker.tasks.train.figures import draw_motion_images
from drake_tracker.vision.frame_difference import DifferenceImages

SIDE = ""
"""Of the ports of the one camera."""
PATH_POINTS = 11
SNAPSHOT_PERIOD = 0.2
"""Time [s] between looks at the motion images: a ball rolls for some two seconds."""


def add_ball_video(builder, hand_eye, scenario, path, onlooker=None):
    """Adds a `CameraVideoSystem` that films the ball's `HandEyeDiagram`, for `film`'s ``path`` and ``onlooker``.

    Returns a `CameraVideoRecorder`.
    """
    foresight = BoardForesight(known_edge(scenario, hand_eye.poses))
    camera, window = board_sight(scenario, hand_eye.poses)
    lag_cycles = hand_eye.vision.lag / VISION_PERIOD
    page = VideoPage(
        {SIDE: window.polygon},
        (camera.width, camera.height),
        title=scenario.name,
        subtitle=f"seed {scenario.seed}, board at {scenario.board.incline_deg:g} deg",
        lag=hand_eye.vision.lag,
        goal="foreseen crossing",
    )
    script = Script(
        phases=CatchPhase,
        predicting=CATCH_PHASES_THAT_PREDICT,
        diagnosis=CatchDiagnosis,
        notes=say_when,
        path=partial(foresight.path, count=PATH_POINTS),
        goal=foresight.goal,
    )
    in_world = replace(camera, X_CW=camera.X_CW @ hand_eye.poses.X_WB.inverse().GetAsMatrix4())
    return film(
        builder, hand_eye, (path, onlooker), page, {SIDE: in_world}, {SIDE: (0, 0)}, lag_cycles, script=script,
        every=round(1.0 / (FRAMES_PER_SECOND * VISION_PERIOD)), update_cycles=scenario.vision.update_cycles,
    )  # fmt: skip


def say_when(phase, diagnosis):
    """Notes of a frame: when the ball is to come, and how sure that place is."""
    if phase not in (CatchPhase.FOLLOW, CatchPhase.SETTLE) or not diagnosis.known:
        return "", ""
    return f"comes in {max(diagnosis.time_left, 0.0):.2f} s", f"within {2e3 * diagnosis.std:.0f} mm (2 std)"


def ball_view(hand_eye, scenario):
    """Returns the `View` in which the recording shows the laboratory of the ball."""
    foresight = BoardForesight(known_edge(scenario, hand_eye.poses))
    return View(
        eye=(1.50, -1.75, 1.95),
        target=(0.58, 0.0, 0.56),
        fov_deg=36.0,
        floor=False,
        phases=CATCH_PHASES_THAT_PREDICT,
        path=partial(foresight.path, count=PATH_MARKS),
    )


def add_ball_snapshot(builder, hand_eye, scenario, path):
    """Adds a `MotionSnapshotSystem`: images while the ball rolls, and of the empty board when it never does.

    Returns a `MotionSnapshotRecorder`.
    """
    cycles = getattr(scenario.vision.detector, "stride", None)  # the others compare with an image of the empty board
    later = f"Image n + {Fraction(cycles, round(1.0 / VISION_PERIOD))} s" if cycles else "Image"
    titles = ("Image n" if cycles else "Compared with", later, "Thresholded difference")

    def draw(images, path):
        if isinstance(images[SIDE], DifferenceImages):
            draw_difference_images(images[SIDE], titles, path)
        else:
            draw_motion_images(images, path)

    phases = (CatchPhase.WAIT, CatchPhase.FOLLOW)
    return add_motion_snapshot(builder, hand_eye, path, draw, sides=(SIDE,), phases=phases, period=SNAPSHOT_PERIOD)
