"""Builds the ball's hand-eye diagram from a scenario (Nashman and Chaconas 1990)."""

from dataclasses import asdict
from functools import partial

import numpy as np

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.cameras.boards.board_poses import BoardPoses
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import BALL_SERVO_PERIOD, PROJECTOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.diagrams.parts import link_of, make_host
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.faults.fault import Fault
from drake_tracker.faults.kinds import make_faults
from drake_tracker.grasp.ball.board_exit import BoardEdge
from drake_tracker.grasp.ball.catch_machine import CatchMachine
from drake_tracker.grasp.ball.catch_system import CatchSystem
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.ball.world import make_ball_world
from drake_tracker.tasks.filming import HAND_BORDER
from drake_tracker.vision.centroid.board_vision_diagram import BoardVisionDiagram
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.centroid.motion_centroid_system import needs_image
from drake_tracker.vision.centroid.motion_detector import MotionDetector
from drake_tracker.vision.centroid.plane_projection import (
    PlausiblePoints,
    board_window,
    camera_on_board,
    seen_whole_from,
)
from drake_tracker.vision.centroid.plane_projector_system import PlaneProjectorSystem
from drake_tracker.vision.centroid.search_window import SearchWindow
from drake_tracker.vision.region_of_interest import RegionOfInterest
from drake_tracker.world.ball.ball_board import BALL_RADIUS
from drake_tracker.world.ball.ball_fixtures import TABLE_HEIGHT
from drake_tracker.world.ball.ball_plant import TABLE_X
from drake_tracker.world.imaging.cameras import ImageWindow, lens_matrix, renderable_window
from drake_tracker.world.imaging.image_pipeline import ImagePipeline, process_count
from drake_tracker.world.train.plant import table_box


def make_ball_diagram(scenario: BallScenario, poses: BoardPoses) -> HandEyeDiagram:
    """Returns the hand-eye diagram of a scenario, with the poses of the board as its attribute ``poses``.

    Args:
        scenario: the scenario. All random numbers are drawn from its ``seed``.
        poses: poses of the board, as `initialise_board` finds them.

    Raises DrakeTrackerError when the scenario cannot be built.
    """
    description = arm_of(scenario)
    model = make_arm_model(description)
    edge = known_edge(scenario, poses)
    waiting = edge.home + [0.0, 0.0, scenario.catch.rim_height, 0.0]
    q_initial = joints_for(model, description.q_start, tool_down(waiting[:3], waiting[3]))

    faults = ball_faults(scenario)
    rendered = rendered_window(scenario, poses)
    detector = board_detector(scenario, poses, rendered)
    pipeline = image_pipeline(scenario, detector)
    world = make_ball_world(
        scenario,
        description=description,
        q_initial=q_initial,
        window=rendered,
        pipeline=pipeline,
        wanted=partial(needs_image, detector, scenario.vision.update_cycles),
        faults=faults,
    )
    vision = board_vision(scenario, poses, detector, rendered, 0 if pipeline is None else pipeline.latency)
    host = ball_host(scenario, poses)
    catch = CatchSystem(CatchMachine(scenario.catch, edge, BALL_SERVO_PERIOD), scenario.time_step, BALL_SERVO_PERIOD)
    catch.set_name("catch")
    guard = ball_guard(scenario, poses)
    arm = ArmDiagram(
        catch,
        guard,
        scenario.servo,
        model,
        q_initial,
        edge.home,
        scenario.time_step,
        BALL_SERVO_PERIOD,
        clearance=ArmClearance(description, [table_box(height=TABLE_HEIGHT, x=TABLE_X)]),
    )
    hand_eye = HandEyeDiagram(world, vision, host, link_of(scenario, faults), arm)
    hand_eye.poses = poses
    return hand_eye


def ball_host(scenario: BallScenario, poses: BoardPoses) -> EstimatorSystem:
    """Returns the host of a scenario, its estimator as a System.

    Args:
        scenario: the scenario.
        poses: poses of the board.

    Raises DrakeTrackerError when the estimator cannot be made.
    """
    board = scenario.board
    slope = make_estimator(
        "slope", X_WB=poses.X_WB.GetAsMatrix4(), width=board.width, length=board.length, ball_radius=BALL_RADIUS,
        walls=board.walls, **asdict(scenario.estimator),
    )  # fmt: skip
    return make_host(slope, scenario.time_step, ball_faults(scenario))


def ball_faults(scenario: BallScenario) -> tuple[Fault, ...]:
    """Returns what goes wrong in a scenario."""
    return make_faults(scenario.faults, seed=scenario.seed, lag=scenario.vision.throughput_cycles * VISION_PERIOD)


def ball_guard(scenario: BallScenario, poses: BoardPoses) -> PacketGuard:
    """Returns the receiver of a scenario's packets. Their paths begin on the board and may end below the table: the
    ball falls freely from the bottom edge.

    Args:
        scenario: the scenario.
        poses: poses of the board.
    """
    board = scenario.board
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (0.0, 1.0) for z in (0.0, 2.0 * BALL_RADIUS)]
    p_BC = np.array(corners) * [board.width, board.length, 1.0]
    p_WC = poses.X_WB.multiply(p_BC.T).T
    return PacketGuard(scenario.guard, np.array([p_WC.min(axis=0), p_WC.max(axis=0)]))


def known_edge(scenario: BallScenario, poses: BoardPoses) -> BoardEdge:
    """Returns the bottom edge of the board, as the arm knows it.

    Args:
        scenario: the scenario.
        poses: poses of the board.
    """
    X_WB, beyond = poses.X_WB.GetAsMatrix4(), scenario.catch.beyond
    return BoardEdge(X_WB, width=scenario.board.width, ball_radius=BALL_RADIUS, beyond=beyond)


def board_sight(scenario: BallScenario, poses: BoardPoses) -> tuple[CameraModel, RegionOfInterest]:
    """Returns the camera in the frame of the board, as the initialisation found it, and the window of interest.

    Args:
        scenario: the scenario.
        poses: poses of the board.
    """
    config, board = scenario.camera, scenario.board
    camera = camera_on_board(lens_matrix(config), poses.X_CB.GetAsMatrix4(), config.width, config.height)
    return camera, board_window(camera, board.width, board.length, 2.0 * BALL_RADIUS, scenario.vision.bottom)


def rendered_window(scenario: BallScenario, poses: BoardPoses) -> ImageWindow:
    """Returns the part of the image that a scenario renders: the board with its surroundings, as the video shows it.

    Args:
        scenario: the scenario.
        poses: poses of the board.
    """
    config = scenario.camera
    if not config.render_window:
        return (0, 0, config.width, config.height)
    _, window = board_sight(scenario, poses)
    u0, v0, width, height = window.bounds
    around = (u0 - HAND_BORDER, v0 - HAND_BORDER, width + 2 * HAND_BORDER, height + 2 * HAND_BORDER)
    return renderable_window(around, config.width, config.height)


def image_pipeline(scenario: BallScenario, detector: MotionDetector) -> ImagePipeline | None:
    """Returns how the images of a scenario are made beside the simulation, or None if they are not.

    Args:
        scenario: the scenario.
        detector: its motion detector.

    Raises DrakeTrackerError when the environment variable for the number of processes is wrong.
    """
    processes = process_count(scenario.camera.render_processes)
    latency = scenario.vision.throughput_cycles - detector.buffer_length
    return ImagePipeline(latency, processes) if processes > 0 and latency > 0 else None


def board_detector(scenario: BallScenario, poses: BoardPoses, rendered: ImageWindow) -> MotionDetector:
    """Returns the motion detector of a scenario.

    Args:
        scenario: the scenario.
        poses: poses of the board.
        rendered: part of the full image that the images show.
    """
    _, window = board_sight(scenario, poses)
    u0, v0, width, height = rendered
    image = poses.image[v0 : v0 + height, u0 : u0 + width]
    return make_detector(scenario.vision.detector, window=window.mask(rendered), image=image)


def board_vision(
    scenario: BallScenario, poses: BoardPoses, detector: MotionDetector, rendered: ImageWindow, image_latency: int = 0
) -> BoardVisionDiagram:
    """Returns the vision of a scenario: from images of the camera to points on the board.

    Args:
        scenario: the scenario.
        poses: poses of the board.
        detector: its motion detector.
        rendered: part of the full image that the images show.
        image_latency: cycles from the capture of an image until the vision sees it.

    Raises DrakeTrackerError when the throughput is too short for the detector.
    """
    settings = scenario.vision
    camera, _ = board_sight(scenario, poses)
    if settings.throughput_cycles < detector.buffer_length:
        raise DrakeTrackerError(
            f"{scenario.where('vision.throughput_cycles')} = {settings.throughput_cycles} must be at least "
            f"{detector.buffer_length}: {detector.buffer_length - 1} from the first image of the detector to the last, "
            "and one for computing"
        )
    return BoardVisionDiagram(
        detector,
        camera,
        poses.X_WB.GetAsMatrix4(),
        settings.centroid_height,
        plausible_points(scenario, poses, camera),
        image_offset=rendered[:2],
        update_cycles=settings.update_cycles,
        throughput_cycles=settings.throughput_cycles,
        time_step=scenario.time_step,
        follow=SearchWindow() if settings.follow else None,
        image_latency=image_latency,
    )


def plausible_points(scenario: BallScenario, poses: BoardPoses, camera: CameraModel) -> PlausiblePoints:
    """Returns which points on the board vision accepts.

    Args:
        scenario: the scenario.
        poses: poses of the board.
        camera: the camera in the frame of the board.
    """
    board, settings = scenario.board, scenario.vision
    incline = np.arccos(poses.X_WB.rotation().matrix()[2, 2])
    seen_from = seen_whole_from(camera, settings.bottom, BALL_RADIUS)
    return PlausiblePoints(board.width, board.length, incline, seen_from, settings.tolerance)


def board_projector(scenario: BallScenario, poses: BoardPoses) -> PlaneProjectorSystem:
    """Returns the part of the vision that a replay of centroids runs: from centroids to points on the board.

    Args:
        scenario: the scenario.
        poses: poses of the board.
    """
    camera, _ = board_sight(scenario, poses)
    return PlaneProjectorSystem(
        camera,
        poses.X_WB.GetAsMatrix4(),
        scenario.vision.centroid_height,
        plausible_points(scenario, poses, camera),
        offset=vision_slot(PROJECTOR_SLOT, scenario.time_step),
    )
