"""Perception initialisation (Nashman and Chaconas 1990, section 3): where the board is, for the camera and for the arm.

Before the ball is there the camera reads the board's four circles, and the arm touches three marks on its face. Four
coplanar points give the board's pose before the camera, X_CB; the plane through the touched points gives it in the
world, X_WB. After that neither is looked at again: a board that is moved later is where it was, to the system.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PROBE_FRAME
from drake_tracker.arm.differential_ik import joints_for
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.machine import require_renderer
from drake_tracker.core.messages import TouchReport
from drake_tracker.core.setting import replace_settings
from drake_tracker.core.timing import BALL_SERVO_PERIOD, VISION_PERIOD
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.grasp.board_touch import board_pose_from_touches
from drake_tracker.grasp.crossing import HAND_YAW
from drake_tracker.grasp.touch_machine import touched_points
from drake_tracker.grasp.touch_schema import TouchPhase
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.ball.touching_diagram import BoardTouchingDiagram
from drake_tracker.tasks.ball.world import make_ball_world
from drake_tracker.tasks.task import AskForWindows
from drake_tracker.vision.board_poses import BoardPoses
from drake_tracker.vision.circle_finder import best_measurement, find_circles, measure_circle
from drake_tracker.vision.circle_pose import image_centres, locate_board
from drake_tracker.world.ball_board import CIRCLE_RADIUS, CIRCLES, TOUCH_MARKS, draw_placing_errors
from drake_tracker.world.cameras import lens_matrix
from drake_tracker.world.config import OperatorConfig

READINGS = 10
"""Images in which the circles are read ("10 histogram readings", section 3)."""
PROBE_RADIUS = 0.004
"""Of the spherical tip of the cup [m]."""
JOG_HEIGHT = 0.008
"""Height [m] over its mark at which the operator leaves the tip."""
START_HEIGHT = 0.20
"""Height [m] over the board's bottom edge at which the tip starts."""
STILL_SUPERSAMPLING = 4
"""Rendered pixels averaged into one, to each side, while nothing moves: more exact, and few images are needed."""
LOOK_EVERY = 0.05
"""Simulated time [s] between looks whether the touching is done."""
LONGEST = 60.0
"""Simulated time [s] after which the touching is given up."""


def initialise_board(scenario: BallScenario, ask_for_windows: AskForWindows | None = None) -> BoardPoses:
    """Returns the `BoardPoses` of a scenario: simulates the measurements of the circles and the touching of the marks.

    Args:
        scenario: scenario of the run; it is not changed.
        ask_for_windows: asks a person, if the scenario has no ``operator.windows``: (RGB images, ``operator``) -> the
            windows, or none to have the circles found. The answer is part of the result.

    Raises DrakeTrackerError when circles are not found, or the arm does not find the board.
    """
    require_renderer()
    description = arm_of(scenario)
    model = make_arm_model(replace(description, tool_frame=PROBE_FRAME))
    p_start = np.array(scenario.board.edge_position) + [0.0, 0.0, START_HEIGHT]
    q_initial = joints_for(model, description.q_start, tool_down(p_start, HAND_YAW))
    still = replace(scenario, camera=replace(scenario.camera, supersampling=STILL_SUPERSAMPLING))
    world = make_ball_world(still, description=description, q_initial=q_initial, ball_on_board=False)
    jogs = operator_jogs(scenario, world.laboratory.X_WB)
    touching = BoardTouchingDiagram(world, model, q_initial, jogs, scenario.time_step, BALL_SERVO_PERIOD)

    simulator = Simulator(touching)
    context = simulator.get_mutable_context()
    images = []
    for k in range(READINGS):
        simulator.AdvanceTo(k * VISION_PERIOD)
        images.append(np.array(touching.GetOutputPort("camera").Eval(context).data[..., :3]))
    operator = scenario.operator
    if ask_for_windows is not None and not operator.windows:
        operator = replace_settings(operator, {"windows": ask_for_windows(images, operator)})
    candidates = read_circles([cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in images], operator)
    p_BQ = np.column_stack([CIRCLES, np.zeros(len(CIRCLES))])
    pose = locate_board(candidates, p_BQ, lens_matrix(scenario.camera), radius=CIRCLE_RADIUS)

    report = touching.GetOutputPort("report")
    while TouchReport(report.Eval(context)).phase not in (TouchPhase.DONE, TouchPhase.MISSED):
        if context.get_time() > LONGEST:
            break
        simulator.AdvanceTo(context.get_time() + LOOK_EVERY)
    points = touched_points(report.Eval(context))
    X_WB = board_pose_from_touches(points, np.array(TOUCH_MARKS), PROBE_RADIUS)
    circles = chosen_circles(candidates, image_centres(pose.X_CB, p_BQ, lens_matrix(scenario.camera), CIRCLE_RADIUS))
    return BoardPoses(RigidTransform(pose.X_CB), X_WB, pose.rms, points, images[0], circles, operator.windows)


def read_circles(images: Sequence[np.ndarray], operator: OperatorConfig) -> list[Any]:
    """Returns the `CircleMeasurement`s of grey images of the same scene that may be the board's circles.

    ``operator``: the scenario's part of that name. In each of the windows marked the reading with the largest area
    counts; without any it is all that looks like a circle. Raises DrakeTrackerError on windows that are not four, or do
    not hold one circle each.
    """
    windows = operator.windows
    if not windows:
        return find_circles(images)
    if len(windows) != len(CIRCLES):
        raise DrakeTrackerError(f"operator.windows: {len(windows)} marked; each of {len(CIRCLES)} circles needs one")
    return [
        best_measurement([measure_circle(image, window, operator.threshold) for image in images]) for window in windows
    ]


def chosen_circles(candidates: Sequence[Any], expected: np.ndarray) -> np.ndarray:
    """Returns the centroids (n, 2) [px] of the candidates that are nearest to the ``expected`` places (n, 2)."""
    uv = np.array([(candidate.u, candidate.v) for candidate in candidates])
    return np.array([uv[np.argmin(np.linalg.norm(uv - place, axis=1))] for place in expected])


def operator_jogs(scenario: BallScenario, X_WB: RigidTransform) -> np.ndarray:
    """Returns the poses (x, y, z, yaw), shape (3, 4), in W at which an operator leaves the probe over the touch marks.

    This stands in for a person, who sees where the marks are: it is given the board's true pose, and errs by
    ``operator.placing_std`` in the plane. The controller is told the jogged poses, and nothing of the errors.
    """
    marks = np.array(TOUCH_MARKS) + draw_placing_errors(scenario.operator, scenario.seed)
    touching = X_WB.multiply(np.column_stack([marks, np.full(3, PROBE_RADIUS)]).T).T  # the tip's centre, on the mark
    return np.column_stack([touching + [0.0, 0.0, JOG_HEIGHT], np.full(3, HAND_YAW)])
