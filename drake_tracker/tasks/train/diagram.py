"""Builds the hand-eye diagram of the train from a scenario (Allen et al. 1991)."""

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.systems.framework import Diagram, System

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.hand_eye_correction import HandEyeCorrection
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.messages import HandPoint
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.diagrams.hand_eye import (
    AT_LAUNCH,
    BETWEEN_SUBSYSTEMS,
    WITH_HAND_POINT,
    WITH_MEASURED_TRACKS,
    WITH_TRACKS,
    WITH_WRIST,
    Connection,
    HandEyeDiagram,
)
from drake_tracker.diagrams.parts import estimator_of, link_of, make_host
from drake_tracker.estimation.estimator_bank_system import EstimatorBankSystem
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.estimation.sudden_change import with_speed_change_detection
from drake_tracker.faults.fault import Fault
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.grasp_system import GraspSystem
from drake_tracker.link.link_diagram import LinkDiagram
from drake_tracker.link.link_system import LinkSystem
from drake_tracker.tasks.train.faults import train_faults
from drake_tracker.tasks.train.reach import Reach
from drake_tracker.tasks.train.scenario import Measured, TrainScenario
from drake_tracker.tasks.train.track_placement import check_track, place_track
from drake_tracker.tasks.train.vision_parts import (
    RenderedWindow,
    image_pipeline,
    make_vision,
    sees_hand,
    tracks_several,
)
from drake_tracker.tasks.train.world import make_train_world
from drake_tracker.tasks.train.wrist_parts import has_wrist
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.train.plant import table_box


def make_train_diagram(scenario: TrainScenario) -> HandEyeDiagram:
    """Returns the hand-eye diagram of a scenario.

    Args:
        scenario: the scenario. All random numbers are drawn from its ``seed``.

    Raises DrakeTrackerError when the scenario cannot be built: a file is missing, the track is out of reach, or the
    vision would never see the train.
    """
    pipeline = image_pipeline(scenario)
    vision, windows = make_vision(scenario, pipeline)
    connections = BETWEEN_SUBSYSTEMS
    if tracks_several(scenario):
        connections = WITH_MEASURED_TRACKS if isinstance(scenario.vision, Measured) else WITH_TRACKS
    if sees_hand(scenario):
        connections = (*connections, *WITH_HAND_POINT)
    if has_wrist(scenario):
        connections = (*connections, *WITH_WRIST)
    return assemble(scenario, vision, windows, train_host(scenario), connections, pipeline)


def assemble(
    scenario: TrainScenario,
    vision: Diagram,
    windows: Mapping[str, RenderedWindow],
    host: System,
    connections: tuple[Connection, ...] = BETWEEN_SUBSYSTEMS,
    pipeline: ImagePipeline | None = None,
) -> HandEyeDiagram:
    """Returns the hand-eye diagram of a scenario with a given vision and host, or with substitutes for them.

    Args:
        scenario: scenario of world, link and arm.
        vision: a Diagram with the ports of `VisionDiagram`.
        windows: {name of the camera: part of the full image to render (u0, v0, width, height) [px]}.
        host: a System with the ports of `EstimatorSystem`.
        connections: connections between ports with different names, as for `HandEyeDiagram`.
        pipeline: how the images that the vision expects are made; None: they are rendered when they are read.

    Raises DrakeTrackerError when the scenario cannot be built.
    """
    reach = Reach(scenario)
    track, start = place_track(scenario, reach)
    check_track(scenario, track, start, reach)

    model, q_initial = reach.model, reach.q_initial
    faults = train_faults(scenario)
    world = make_train_world(
        scenario,
        description=reach.description,
        q_initial=q_initial,
        track=track,
        start=start,
        windows=windows,
        pipeline=pipeline,
        faults=faults,
    )
    link = train_link(scenario, faults)
    grasp = GraspSystem(GraspMachine(scenario.grasp, model, SERVO_PERIOD, reach.home[2]), scenario.time_step)
    grasp.set_name("grasp")
    arm = ArmDiagram(
        grasp,
        train_guard(scenario),
        scenario.servo,
        model,
        q_initial,
        reach.home,
        scenario.time_step,
        jaw_opening=scenario.grasp.jaw_opening,
        clearance=ArmClearance(reach.description, [table_box(height=scenario.table_height)]),
        edge=HandEyeCorrection(scenario.hand_eye) if sees_hand(scenario) else None,
    )
    if world.HasInputPort("launch"):
        connections = (*connections, AT_LAUNCH)
    return HandEyeDiagram(world, vision, host, link, arm, connections)


def train_host(scenario: TrainScenario) -> EstimatorSystem | EstimatorBankSystem:
    """Returns the host of a scenario, its estimator as a System. Raises DrakeTrackerError when it cannot be made.

    For a guided descent the estimator also notices sudden changes of speed (`SuddenChangeEstimator`).
    """
    estimator = estimator_of(scenario.estimator, scenario.where("estimator"))
    if scenario.grasp.descent == "guided":  # a blind descent could not use what it notices
        estimator = with_speed_change_detection(estimator)
    return make_host(estimator, scenario.time_step, train_faults(scenario), tracks_several(scenario))


def train_link(scenario: TrainScenario, faults: Sequence[Fault]) -> LinkSystem | LinkDiagram:
    """Returns the link of a scenario, which also carries the measurements of the hand if vision sees it.

    Args:
        scenario: the scenario.
        faults: what goes wrong; of these, those of the link.
    """
    link = link_of(scenario, faults)
    return LinkDiagram(link, link_of(scenario, faults, HandPoint)) if sees_hand(scenario) else link


def train_guard(scenario: TrainScenario) -> PacketGuard:
    """Returns the receiver of a scenario's packets. Their paths begin in the work volume of the vision."""
    return PacketGuard(scenario.guard, np.array(scenario.vision.work_volume), scenario.table_height)
