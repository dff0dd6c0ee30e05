"""Perception initialisation (Nashman and Chaconas 1990, section 3): finds the board, for the camera and for the arm.

Before the ball is placed, the camera measures the four circles of the board, and the arm touches three marks on its
face. Four coplanar points give the pose of the board in the camera, X_CB; the plane through the touched points gives
the pose in the world, X_WB. Both stay fixed afterwards: the system does not notice when the board is moved.
"""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_tracker.arm.arm_model import ArmModel, make_arm_model, tool_down
from drake_tracker.arm.description import PROBE_FRAME
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.cameras.boards.board_poses import BoardPoses
from drake_tracker.cameras.boards.circle_finder import CircleMeasurement, best_measurement, find_circles, measure_circle
from drake_tracker.cameras.boards.circle_pose import BoardPose, image_centres, locate_board
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import TouchReport
from drake_tracker.core.setting import replace_settings
from drake_tracker.core.system_check import require_renderer
from drake_tracker.core.timing import BALL_SERVO_PERIOD, VISION_PERIOD
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.grasp.ball.board_exit import HAND_YAW
from drake_tracker.grasp.ball.board_touch import board_pose_from_touches
from drake_tracker.grasp.ball.touch_diagram import TouchDiagram
from drake_tracker.grasp.ball.touch_machine import TouchPhase, touched_points
from drake_tracker.tasks.ball.scenario import STILL_SUPERSAMPLING, BallScenario
from drake_tracker.tasks.task import AskForWindows
from drake_tracker.world.ball.ball_board import CIRCLE_RADIUS, CIRCLES, TOUCH_MARKS, draw_placing_errors
from drake_tracker.world.ball.ball_camera import NAME
from drake_tracker.world.ball.ball_world_diagram import BallWorldDiagram
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.config import BoardCameraConfig, OperatorConfig
from drake_tracker.world.imaging.cameras import lens_matrix

CIRCLE_CENTRES = np.column_stack([CIRCLES, np.zeros(len(CIRCLES))])
"""Centres of the circles (x, y, z) in B [m], shape (4, 3)."""
CIRCLE_IMAGES = 10
"""Number of images in which the circles are measured ("10 histogram readings", section 3)."""
PROBE_RADIUS = 0.004
"""Radius of the spherical tip of the cup [m]."""
JOG_HEIGHT = 0.008
"""Height over its mark at which the operator leaves the tip [m]."""
START_HEIGHT = 0.20
"""Height over the bottom edge of the board at which the tip starts [m]."""
TOUCH_TIME_STEP = BALL_SERVO_PERIOD / 2
"""Shortest step of the plant while the arm touches the board [s]; nothing is fast then."""
CHECK_PERIOD = 0.05
"""Simulated time between two checks whether the touching is done [s]."""
LONGEST = 60.0
"""Simulated time after which the touching is abandoned [s]."""


class BoardTouchingDiagram(Diagram):
    """The laboratory of the ball with an arm that touches the marks over which an operator has jogged it.

    .. pydrake_system::

        name: BoardTouchingDiagram
        output_ports:
        - report
        - truth_query

    - ``report``: a `TouchReport`, updated every ``period``. The positions of marks that are not touched yet are zero.
    - ``truth_query``: a QueryObject of the world's scene, ground truth.

    There is no vision in the loop.

    Args:
        world: the laboratory, without a ball on the board.
        model: the controller's model of the arm, with the probe as its tool.
        q_initial: joints at the start [rad], shape (n,).
        jogs: poses (x, y, z, yaw) in W over the marks [m, rad], shape (3, 4).
        time_step: the plant's step [s].
        period: period of the set-points [s].

    Attributes:
        world: the laboratory.
    """

    def __init__(
        self,
        world: BallWorldDiagram,
        model: ArmModel,
        q_initial: np.ndarray,
        jogs: np.ndarray,
        time_step: float,
        period: float,
    ) -> None:
        super().__init__()
        self.set_name("touching")
        self.world = world
        builder = DiagramBuilder()
        builder.AddSystem(world)
        arm = builder.AddSystem(TouchDiagram(model, q_initial, jogs, time_step, period))
        for port in ("arm_state", "arm_effort"):
            builder.Connect(world.GetOutputPort(port), arm.GetInputPort(port))
        for port in ("arm_desired_state", "arm_feedforward"):
            builder.Connect(arm.GetOutputPort(port), world.GetInputPort(port))
        builder.ExportOutput(arm.GetOutputPort("report"), "report")
        builder.ExportOutput(world.GetOutputPort("truth_query"), "truth_query")
        builder.BuildInto(self)


def initialise_board(scenario: BallScenario, ask_for_windows: AskForWindows | None = None) -> BoardPoses:
    """Finds the board of a scenario: simulates the measurement of the circles and the touching of the marks.

    Args:
        scenario: scenario of the run; it is not changed.
        ask_for_windows: asks a person for windows around the circles if ``operator.windows`` is empty: (RGB images,
            ``operator``) -> windows (u0, v0, width, height) [px]. The circles are found automatically if the answer is
            empty. The answer is part of the result.

    Returns the poses of the board, for the camera and for the arm.

    Raises DrakeTrackerError when the circles are not found, or when the arm does not find the board.
    """
    touching = make_touching_diagram(scenario)
    simulator = Simulator(touching)
    context = simulator.get_mutable_context()
    images = photograph_board(touching, context)
    operator = scenario.operator
    if ask_for_windows is not None and not operator.windows:
        operator = replace_settings(operator, {"windows": ask_for_windows(images, operator)})
    candidates, pose = find_board(images, scenario.camera, operator)

    report = touching.GetOutputPort("report")
    while TouchReport(report.Eval(context)).phase not in (TouchPhase.DONE, TouchPhase.MISSED):
        if context.get_time() > LONGEST:
            break
        simulator.AdvanceTo(context.get_time() + CHECK_PERIOD)
    points = touched_points(report.Eval(context))
    X_WB = board_pose_from_touches(points, np.array(TOUCH_MARKS), PROBE_RADIUS)
    centres = image_centres(pose.X_CB, CIRCLE_CENTRES, lens_matrix(scenario.camera), CIRCLE_RADIUS)
    circles = chosen_circles(candidates, centres)
    return BoardPoses(RigidTransform(pose.X_CB), X_WB, pose.rms, points, images[0], circles, operator.windows)


def make_touching_diagram(scenario: BallScenario) -> BoardTouchingDiagram:
    """Returns the laboratory of a scenario before the ball is placed, with an arm that touches the board.

    Args:
        scenario: the scenario.

    Raises DrakeTrackerError when this machine cannot render, or when no pose of the camera sees the whole board.
    """
    require_renderer()
    description = arm_of(scenario)
    model = make_arm_model(replace(description, tool_frame=PROBE_FRAME))
    p_start = np.array(scenario.board.edge_position) + [0.0, 0.0, START_HEIGHT]
    q_initial = joints_for(model, description.q_start, tool_down(p_start, HAND_YAW))
    time_step = max(scenario.time_step, TOUCH_TIME_STEP)
    still = replace(scenario, time_step=time_step, camera=replace(scenario.camera, supersampling=STILL_SUPERSAMPLING))
    config = WorldConfig(
        arm=description, q_initial=q_initial, lighting=still.lighting, seed=still.seed, time_step=still.time_step
    )
    world = BallWorldDiagram(
        config,
        board=still.board,
        ball=still.ball,
        camera=still.camera,
        ball_on_board=False,  # it lies aside, and the gate is open
    )
    jogs = operator_jogs(scenario, world.laboratory.X_WB)
    return BoardTouchingDiagram(world, model, q_initial, jogs, time_step, BALL_SERVO_PERIOD)


def photograph_board(touching: BoardTouchingDiagram, context: Context) -> list[np.ndarray]:
    """Returns the images in which the circles are measured, RGB, each of shape (h, w, 3).

    They are taken in consecutive cycles while nothing moves, before the touching begins. The scene is therefore
    rendered once, and each image has its own noise and flicker.

    Args:
        touching: the return value of `make_touching_diagram`.
        context: of this diagram, before the touching.
    """
    camera = touching.world.cameras[NAME]
    rendered = camera.sensor_port.Eval(camera.sensor.GetMyContextFromRoot(context)).data
    return [camera.model.image(rendered, k * VISION_PERIOD)[..., :3].copy() for k in range(CIRCLE_IMAGES)]


def find_board(
    images: Sequence[np.ndarray], camera: BoardCameraConfig, operator: OperatorConfig
) -> tuple[list[CircleMeasurement], BoardPose]:
    """Returns measurements of candidate circles, and the pose of the board in the camera that fits four circles.

    Args:
        images: RGB images of the board, each of shape (h, w, 3).
        camera: the camera, whose intrinsics are known.
        operator: windows that a person marked around the circles, if any.

    Raises DrakeTrackerError when the board is not found.
    """
    candidates = measure_circles([cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in images], operator)
    return candidates, locate_board(candidates, CIRCLE_CENTRES, lens_matrix(camera), radius=CIRCLE_RADIUS)


def measure_circles(images: Sequence[np.ndarray], operator: OperatorConfig) -> list[CircleMeasurement]:
    """Returns measurements of the candidate circles of the board.

    With windows, the measurement with the largest area in each window is returned. Without windows, everything that
    looks like a circle is returned.

    Args:
        images: grey images of the same scene.
        operator: windows that a person marked around the circles, if any, and the threshold.

    Raises DrakeTrackerError when there are windows but not four, or when a window does not contain exactly one circle.
    """
    windows = operator.windows
    if not windows:
        return find_circles(images)
    if len(windows) != len(CIRCLES):
        raise DrakeTrackerError(
            f"operator.windows has {len(windows)} windows; it must have one for each of the {len(CIRCLES)} circles"
        )
    return [
        best_measurement([measure_circle(image, window, operator.threshold) for image in images]) for window in windows
    ]


def chosen_circles(candidates: Sequence[CircleMeasurement], expected: np.ndarray) -> np.ndarray:
    """Returns the centroids of the candidates that are nearest to expected centres [px], shape (n, 2).

    Args:
        candidates: measurements of what may be circles.
        expected: expected centres [px], shape (n, 2).
    """
    uv = np.array([(candidate.u, candidate.v) for candidate in candidates])
    return np.array([uv[np.argmin(np.linalg.norm(uv - place, axis=1))] for place in expected])


def operator_jogs(scenario: BallScenario, X_WB: RigidTransform) -> np.ndarray:
    """Returns the poses (x, y, z, yaw) in W at which an operator leaves the probe over the touch marks, shape (3, 4).

    This function simulates a person, who sees the marks. It therefore uses the true pose of the board, with placement
    errors of standard deviation ``operator.placing_std`` in the plane of the board. The controller knows the jogged
    poses but not the errors.

    Args:
        scenario: the scenario.
        X_WB: true pose of the board in the world.
    """
    marks = np.array(TOUCH_MARKS) + draw_placing_errors(scenario.operator, scenario.seed)
    touching = X_WB.multiply(np.column_stack([marks, np.full(3, PROBE_RADIUS)]).T).T  # centre of the tip on the mark
    return np.column_stack([touching + [0.0, 0.0, JOG_HEIGHT], np.full(3, HAND_YAW)])
