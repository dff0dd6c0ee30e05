"""Builds the hand-eye diagram of the ball, the boxes of Nashman and Chaconas 1990 in the order of the data."""

from dataclasses import asdict
from functools import partial

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import BALL_SERVO_PERIOD, PROJECTOR_SLOT, vision_slot
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram, connect
from drake_tracker.diagrams.parts import link_of, make_host
from drake_tracker.estimation.estimator import make_estimator
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.grasp.ball.catch_machine import CatchMachine
from drake_tracker.grasp.ball.catch_system import CatchSystem
from drake_tracker.tasks.ball.setup import BallSetup
from drake_tracker.vision.centroid.board_vision_diagram import BoardVisionDiagram
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.centroid.motion_centroid_system import needs_image
from drake_tracker.vision.centroid.motion_detector import MotionDetector
from drake_tracker.vision.centroid.plane_projector_system import PlaneProjectorSystem
from drake_tracker.vision.centroid.search_window import SearchWindow
from drake_tracker.world.ball.ball_board import BALL_RADIUS
from drake_tracker.world.ball.ball_camera import NAME
from drake_tracker.world.ball.ball_fixtures import TABLE_HEIGHT
from drake_tracker.world.ball.ball_plant import TABLE_X
from drake_tracker.world.ball.ball_world_diagram import BallWorldDiagram
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.imaging.image_pipeline import ImagePipeline, process_count
from drake_tracker.world.train.plant import table_box


def build(setup: BallSetup, decision: System | None = None) -> HandEyeDiagram:
    """Adds and connects the five boxes of a hand-eye system.

    Args:
        setup: the resolved scenario.
        decision: replaces the catch machine.

    Raises DrakeTrackerError when the scenario cannot be built.
    """
    detector = board_detector(setup, setup.window)
    pipeline = image_pipeline(setup, detector)

    builder = DiagramBuilder()
    world = add_world(setup, builder, pipeline)
    vision = board_vision(setup, detector, setup.window, 0 if pipeline is None else pipeline.latency)
    builder.AddSystem(vision)
    host, link, arm = add_controller(setup, builder, decision=decision)

    # Images become points on the board, and points become predictions.
    connect(builder, world, vision)
    connect(builder, vision, host)
    # The arm reads its joints and drives them. It also says when it is ready for the ball.
    connect(builder, world, arm)
    connect(builder, arm, world)

    hand_eye = HandEyeDiagram(builder, world=world, vision=vision, host=host, link=link, arm=arm)
    hand_eye.poses = setup.poses
    return hand_eye


def add_controller(
    setup: BallSetup, builder: DiagramBuilder, *, host: System | None = None, decision: System | None = None
) -> Controller:
    """Adds and connects host, link and arm. ``host`` and ``decision`` replace the host and the catch machine."""
    host = builder.AddSystem(ball_host(setup) if host is None else host)
    link = builder.AddSystem(link_of(setup.scenario, setup.faults))
    arm = add_arm(setup, builder, decision)
    connect(builder, host, link, prediction="packet")
    connect(builder, link, arm, delivered="packet")
    return host, link, arm


def add_world(setup: BallSetup, builder: DiagramBuilder, pipeline: ImagePipeline | None) -> BallWorldDiagram:
    """Adds the laboratory: table, arm, board, ball, camera, lamps, and the judge.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
        pipeline: how the images are made beside the simulation; None: they are rendered when they are read.
    """
    scenario = setup.scenario
    config = WorldConfig(
        arm=setup.arm,
        q_initial=setup.q_initial,
        lighting=scenario.lighting,
        windows={NAME: setup.window},
        pipeline=pipeline,
        faults=setup.faults,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
    return builder.AddSystem(BallWorldDiagram(config, board=scenario.board, ball=scenario.ball, camera=scenario.camera))


def add_arm(setup: BallSetup, builder: DiagramBuilder, decision: System | None = None) -> ArmDiagram:
    """Adds the computer of the arm: packet guard, servo, catch machine, transform equation and inverse kinematics.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
        decision: replaces the catch machine; None: it is made.
    """
    scenario, edge = setup.scenario, setup.edge
    if decision is None:
        machine = CatchMachine(scenario.catch, edge, BALL_SERVO_PERIOD)
        decision = CatchSystem(machine, scenario.time_step, BALL_SERVO_PERIOD)
        decision.set_name("catch")
    return builder.AddSystem(
        ArmDiagram(
            decision,
            ball_guard(setup),
            scenario.servo,
            setup.model,
            setup.q_initial,
            edge.home,
            scenario.time_step,
            BALL_SERVO_PERIOD,
            clearance=ArmClearance(setup.arm, [table_box(height=TABLE_HEIGHT, x=TABLE_X)]),
        )
    )


def ball_host(setup: BallSetup) -> EstimatorSystem:
    """Returns the host, its estimator as a System.

    Args:
        setup: the resolved scenario.

    Raises DrakeTrackerError when the estimator cannot be made.
    """
    board = setup.scenario.board
    estimator = make_estimator(
        "inclined_plane", X_WB=setup.poses.X_WB.GetAsMatrix4(), width=board.width, length=board.length,
        ball_radius=BALL_RADIUS, walls=board.walls, **asdict(setup.scenario.estimator),
    )  # fmt: skip
    return make_host(estimator, setup.scenario.time_step, setup.faults)


def ball_guard(setup: BallSetup) -> PacketGuard:
    """Returns the receiver of packets. Their paths begin on the board and may end below the table: the ball falls
    freely from the bottom edge.

    Args:
        setup: the resolved scenario.
    """
    board = setup.scenario.board
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (0.0, 1.0) for z in (0.0, 2.0 * BALL_RADIUS)]
    p_BC = np.array(corners) * [board.width, board.length, 1.0]
    p_WC = setup.poses.X_WB.multiply(p_BC.T).T
    return PacketGuard(setup.scenario.guard, np.array([p_WC.min(axis=0), p_WC.max(axis=0)]))


def image_pipeline(setup: BallSetup, detector: MotionDetector) -> ImagePipeline | None:
    """Returns how the images are made beside the simulation, or None if they are not.

    Args:
        setup: the resolved scenario.
        detector: the motion detector.

    Raises DrakeTrackerError when the environment variable for the number of processes is wrong.
    """
    processes = process_count(setup.scenario.camera.render_processes)
    latency = setup.scenario.vision.throughput_cycles - detector.buffer_length
    wanted = partial(needs_image, detector, setup.scenario.vision.update_cycles)
    return ImagePipeline(latency, processes, wanted) if processes > 0 and latency > 0 else None


def board_detector(setup: BallSetup, window: ImageWindow) -> MotionDetector:
    """Returns the motion detector.

    Args:
        setup: the resolved scenario.
        window: part of the full image that the images show.
    """
    u0, v0, width, height = window
    image = setup.poses.image[v0 : v0 + height, u0 : u0 + width]
    return make_detector(setup.scenario.vision.detector, window=setup.search_window.mask(window), image=image)


def board_vision(
    setup: BallSetup, detector: MotionDetector, window: ImageWindow, image_latency: int = 0
) -> BoardVisionDiagram:
    """Returns the vision: from images of the camera to points on the board.

    Args:
        setup: the resolved scenario.
        detector: the motion detector.
        window: part of the full image that the images show.
        image_latency: cycles from the capture of an image until the vision sees it.

    Raises DrakeTrackerError when the throughput is too short for the detector.
    """
    settings = setup.scenario.vision
    if settings.throughput_cycles < detector.buffer_length:
        raise DrakeTrackerError(
            f"{setup.scenario.where('vision.throughput_cycles')} = {settings.throughput_cycles} must be at least "
            f"{detector.buffer_length}: {detector.buffer_length - 1} from the first image of the detector to the last, "
            "and one for computing"
        )
    return BoardVisionDiagram(
        detector,
        setup.camera,
        setup.poses.X_WB.GetAsMatrix4(),
        settings.centroid_height,
        setup.plausible_points,
        image_offset=window[:2],
        update_cycles=settings.update_cycles,
        throughput_cycles=settings.throughput_cycles,
        time_step=setup.scenario.time_step,
        follow=SearchWindow() if settings.follow else None,
        image_latency=image_latency,
    )


def board_projector(setup: BallSetup) -> PlaneProjectorSystem:
    """Returns the part of the vision that a replay of centroids runs: from centroids to points on the board.

    Args:
        setup: the resolved scenario.
    """
    return PlaneProjectorSystem(
        setup.camera,
        setup.poses.X_WB.GetAsMatrix4(),
        setup.scenario.vision.centroid_height,
        setup.plausible_points,
        offset=vision_slot(PROJECTOR_SLOT, setup.scenario.time_step),
    )
