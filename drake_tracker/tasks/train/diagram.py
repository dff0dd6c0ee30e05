"""Builds the hand-eye diagram of the train: the boxes of figure 1 of Allen et al. 1991, in their order."""

from collections.abc import Mapping

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, System

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.hand_eye_correction import HandEyeCorrection
from drake_tracker.arm.motion.transform_equation import LEVEL
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.messages import HandPoint
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram, connect
from drake_tracker.diagrams.parts import estimator_of, link_of, make_host
from drake_tracker.estimation.estimator_bank_system import EstimatorBankSystem
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.estimation.sharp_corners import SharpCornersEstimator
from drake_tracker.estimation.sudden_change import with_speed_change_detection
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.grasp_system import GraspSystem
from drake_tracker.link.link_system import LinkDiagram, LinkSystem
from drake_tracker.tasks.train.objects import train_objects
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.tasks.train.track_placement import check_track
from drake_tracker.tasks.train.vision import make_vision
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.train.plant import table_box
from drake_tracker.world.train.world_diagram import WorldDiagram


def build(
    setup: TrainSetup, *, vision: Diagram | None = None, host: System | None = None, decision: System | None = None
) -> HandEyeDiagram:
    """Adds and connects the five boxes of a hand-eye system.

    Args:
        setup: the resolved scenario.
        vision: a substitute for the vision of the scenario.
        host: a substitute for the host of the scenario.
        decision: replaces the grasp machine.

    Raises DrakeTrackerError when the scenario cannot be built.
    """
    # A substitute for the vision reads images when it needs them; only the real one waits for other processes.
    pipeline = setup.pipeline if vision is None else None
    vision = make_vision(setup) if vision is None else vision

    # Check that the train can run on its track, and that the arm can grasp it there.
    check_track(setup.scenario, *setup.placement, setup.reach)

    builder = DiagramBuilder()
    world = add_world(setup, builder, pipeline)
    builder.AddSystem(vision)
    host, link, arm = add_controller(setup, builder, host=host, decision=decision)

    # Images go to vision, or the truth if vision is measured, and the joints if vision masks the arm.
    connect(builder, world, vision)
    # The point goes to the host, or the tracks of several objects. The host says where it expects those that are lost.
    connect(builder, vision, host)
    connect(builder, host, vision)
    # The measured points of the hand go over the link if vision sees its markers.
    connect(builder, vision, link)
    # The arm reads its joints and jaws, and drives them. A launch may trigger an event in the laboratory.
    connect(builder, world, arm)
    connect(builder, arm, world, command="launch")

    return HandEyeDiagram(builder, world=world, vision=vision, host=host, link=link, arm=arm)


def add_controller(
    setup: TrainSetup, builder: DiagramBuilder, *, host: System | None = None, decision: System | None = None
) -> Controller:
    """Adds and connects host, link and arm. ``host`` and ``decision`` replace the host and the grasp machine."""
    host = builder.AddSystem(make_train_host(setup) if host is None else host)
    link = add_link(setup, builder)
    arm = add_arm(setup, builder, decision)
    connect(builder, host, link, prediction="packet")
    connect(builder, link, arm, delivered="packet", delivered_hand_point="hand_point")
    return host, link, arm


def add_world(setup: TrainSetup, builder: DiagramBuilder, pipeline: ImagePipeline | None = None) -> WorldDiagram:
    """Adds the laboratory: table, arm, track, train and further objects, cameras, lamps, and the judge.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
        pipeline: how the images are made beside the simulation; None: they are rendered when they are read.
    """
    windows = {} if setup.measured else {f"camera_{side}": window for side, window in setup.windows.items()}
    return builder.AddSystem(make_world(setup, windows, pipeline))


def make_world(
    setup: TrainSetup, windows: Mapping[str, ImageWindow] | None = None, pipeline: ImagePipeline | None = None
) -> WorldDiagram:
    """Returns the laboratory.

    Args:
        setup: the resolved scenario.
        windows: {name of the camera: window to render}. None renders the full images; an empty dict adds no cameras.
        pipeline: as for `add_world`.
    """
    scenario, (track, start) = setup.scenario, setup.placement
    config = WorldConfig(
        arm=setup.arm,
        q_initial=setup.reach.q_initial,
        jaw_opening=setup.grasp.jaw_opening,
        grip_force=setup.grasp.grip_force,
        lighting=scenario.lighting,
        windows=windows,
        pipeline=pipeline,
        faults=setup.faults,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
    return WorldDiagram(
        config,
        track=track,
        start=start,
        motion=scenario.track,
        train=scenario.train,
        table_height=scenario.table_height,
        table_colour=scenario.table_colour,
        cameras=scenario.cameras,
        objects=train_objects(scenario, track, start),
        judge_all=setup.several,
    )


def make_train_host(setup: TrainSetup) -> EstimatorSystem | EstimatorBankSystem:
    """Returns the host: an estimator for the object, or one for each of several objects.

    For a guided descent the estimator also detects sudden changes of speed, and expects sharp corners; a blind descent
    could use neither.

    Args:
        setup: the resolved scenario.

    Raises DrakeTrackerError when the estimator cannot be made.
    """
    estimator = estimator_of(setup.scenario.estimator, setup.scenario.where("estimator"))
    if setup.grasp.descent == "guided":
        estimator = SharpCornersEstimator(with_speed_change_detection(estimator))
    return make_host(estimator, setup.scenario.time_step, setup.faults, setup.several)


def add_link(setup: TrainSetup, builder: DiagramBuilder) -> LinkSystem | LinkDiagram:
    """Adds the link, which also carries the measured points of the hand if vision sees its markers.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
    """
    link = link_of(setup.scenario, setup.faults)
    if not setup.sees_hand:
        return builder.AddSystem(link)
    return builder.AddSystem(LinkDiagram(link, link_of(setup.scenario, setup.faults, HandPoint)))


def add_arm(setup: TrainSetup, builder: DiagramBuilder, decision: System | None = None) -> ArmDiagram:
    """Adds the computer of the arm: packet guard, servo, grasp machine, transform equation and inverse kinematics.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
        decision: replaces the grasp machine; None: it is made.
    """
    scenario, reach = setup.scenario, setup.reach
    if decision is None:
        machine = GraspMachine(setup.grasp, reach.model, SERVO_PERIOD, setup.home[2])
        decision = GraspSystem(machine, scenario.time_step)
        decision.set_name("grasp")
    return builder.AddSystem(
        ArmDiagram(
            decision,
            train_guard(setup),
            scenario.servo,
            reach.model,
            reach.q_initial,
            setup.home,
            scenario.time_step,
            jaw_opening=setup.grasp.jaw_opening,
            clearance=ArmClearance(setup.arm, [table_box(height=scenario.table_height)]),
            edge=HandEyeCorrection(scenario.hand_eye) if setup.sees_hand else None,
            object_yaw=None if scenario.track.turns else 0.0,
            slope=None if setup.grasp.follow_tilt else LEVEL,
        )
    )


def train_guard(setup: TrainSetup) -> PacketGuard:
    """Returns the receiver of packets. Their paths begin in the work volume of the vision."""
    scenario = setup.scenario
    return PacketGuard(scenario.guard, np.array(scenario.vision.work_volume), scenario.table_height)
