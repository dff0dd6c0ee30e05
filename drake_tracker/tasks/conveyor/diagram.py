"""Builds the hand-eye diagram of the conveyor, its boxes in the order of the data."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, System

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import PickOrder
from drake_tracker.core.timing import ESTIMATOR_SLOT, SERVO_PERIOD, vision_slot
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram, connect
from drake_tracker.diagrams.parts import link_of
from drake_tracker.dispatch.candidate import Cell
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.dispatcher import make_dispatcher
from drake_tracker.dispatch.order_tracker import OrderClerk
from drake_tracker.dispatch.pick_host_system import CellPose, PickHostSystem
from drake_tracker.estimation.belt import BeltEstimator
from drake_tracker.grasp.conveyor.pick_machine import PickMachine
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.grasp.conveyor.pick_system import PickSystem
from drake_tracker.link.link_system import LinkDiagram
from drake_tracker.measured.measured_parts_system import MeasuredPartsSystem
from drake_tracker.measured.measured_vision_diagram import MeasuredVisionDiagram
from drake_tracker.tasks.conveyor.scenario import Measured
from drake_tracker.tasks.conveyor.setup import CELL_YAW, ConveyorSetup
from drake_tracker.vision.parts.part_vision_diagram import PartVisionDiagram
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.conveyor.conveyor_config import cell_centres
from drake_tracker.world.conveyor.conveyor_plant import table_below
from drake_tracker.world.conveyor.conveyor_world_diagram import ConveyorWorldDiagram
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.train.plant import table_box

SEEKING = (PickPhase.WAIT, PickPhase.TRACK)
"""Phases in which the hand has not yet begun to descend."""
CARRYING = (PickPhase.CARRY, PickPhase.LOWER, PickPhase.RELEASE, PickPhase.RAISE)
"""Phases in which it carries a part, puts it down or comes back."""
MOST_PARTS = 300
"""Greatest number of parts in a run. Each is a body of the plant, and with 300 a run takes 20 times the real time."""
HIGHEST_PART = 0.05
"""Largest height of the origin of a part above the floor of its cell [m]."""
BESIDE_BELT = 0.02
"""Distance beside and above the belt up to which a packet may begin [m]."""


def build(setup: ConveyorSetup, decision: System | None = None) -> HandEyeDiagram:
    """Adds and connects the five boxes of a hand-eye system.

    Args:
        setup: the resolved scenario.
        decision: replaces the pick machine.

    Raises DrakeTrackerError when the scenario cannot be built.
    """
    scenario = setup.scenario
    if not setup.arrivals:
        raise DrakeTrackerError(
            f"{scenario.where('duration')}: no part arrives within {scenario.duration:g} s with seed {scenario.seed}; "
            "choose a longer run, or a larger arrivals.rate"
        )
    if len(setup.arrivals) > MOST_PARTS:
        raise DrakeTrackerError(
            f"{scenario.where('duration')}: {len(setup.arrivals)} parts arrive within {scenario.duration:g} s, and "
            f"a run has at most {MOST_PARTS}; run several seeds instead (drake-tracker campaign)"
        )
    builder = DiagramBuilder()
    vision = make_vision(setup)
    world = add_world(setup, builder)
    builder.AddSystem(vision)
    host, link, arm = add_controller(setup, builder, decision=decision)

    # Images become parts on the belt. The host also reads the encoder of the belt.
    connect(builder, world, vision)
    connect(builder, vision, host)
    connect(builder, world, host)
    # The arm reads its joints and jaws, and drives them.
    connect(builder, world, arm)
    connect(builder, arm, world)

    return HandEyeDiagram(builder, world=world, vision=vision, host=host, link=link, arm=arm)


def add_controller(
    setup: ConveyorSetup, builder: DiagramBuilder, *, host: System | None = None, decision: System | None = None
) -> Controller:
    """Adds and connects host, link and arm. ``host`` and ``decision`` replace the host and the pick machine.

    Packets and orders go over the link; the host reads what the arm reports.
    """
    host = builder.AddSystem(conveyor_host(setup) if host is None else host)
    link = builder.AddSystem(conveyor_link(setup))
    arm = add_arm(setup, builder, decision)
    connect(builder, arm, host)
    connect(builder, host, link, prediction="packet")
    connect(builder, link, arm, delivered="packet", delivered_order="order")
    return host, link, arm


def add_world(setup: ConveyorSetup, builder: DiagramBuilder) -> ConveyorWorldDiagram:
    """Adds the laboratory: belt, parts, trays, arm, cameras, lamps, and the judge.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
    """
    scenario = setup.scenario
    config = WorldConfig(
        arm=setup.arm,
        q_initial=setup.q_initial,
        jaw_opening=scenario.pick.jaw_opening,
        grip_force=scenario.pick.grip_force,
        lighting=scenario.lighting,
        windows={} if setup.measured else {f"camera_{side}": setup.windows[side] for side in SIDES},
        pipeline=setup.pipeline,
        faults=setup.faults,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
    return builder.AddSystem(
        ConveyorWorldDiagram(
            config,
            arrivals=setup.arrivals,
            duration=scenario.duration,
            belt=scenario.belt,
            tray=scenario.tray,
            cameras=scenario.cameras,
        )
    )


def make_vision(setup: ConveyorSetup) -> Diagram:
    """Returns the vision of a run.

    Args:
        setup: the resolved scenario.

    Raises DrakeTrackerError when the calibration file cannot be used, or the cameras do not see the belt.
    """
    if setup.measured:
        return measured_vision(setup)
    latency = 0 if setup.pipeline is None else setup.pipeline.latency
    return image_vision(setup, setup.windows, image_latency=latency)


def measured_vision(setup: ConveyorSetup) -> MeasuredVisionDiagram:
    """Returns the vision without cameras, which sees the belt from its entry to its end.

    Args:
        setup: the resolved scenario.
    """
    settings, belt = setup.scenario.vision, setup.scenario.belt
    assert isinstance(settings, Measured)
    system = MeasuredPartsSystem(
        settings,
        [arrival.kind for arrival in setup.arrivals],
        belt_height=belt.height,
        view=setup.belt_between(belt.entry, belt.end),
        frame=belt.frame,
        seed=setup.scenario.seed,
    )
    return MeasuredVisionDiagram([system], settings.lag_cycles)


def image_vision(setup: ConveyorSetup, windows: Mapping[str, ImageWindow], **more: Any) -> PartVisionDiagram:
    """Returns the vision on images, which reports parts from the entry of the belt to its end.

    Args:
        setup: the resolved scenario.
        windows: {side: window of the full image that the images show}.
        **more: further arguments of `PartVisionDiagram`.

    Raises DrakeTrackerError when the calibration file cannot be used, or the cameras do not see the belt.
    """
    settings, belt = setup.rendered, setup.scenario.belt
    check_view(setup)
    return PartVisionDiagram(
        setup.cameras,
        image_windows=windows,
        belt=setup.seen_belt,
        belt_height=belt.height,
        reach=(belt.entry, belt.end),
        frame=belt.frame,
        settings=settings.parts,
        arm=(ArmShape(setup.arm), len(setup.arm.q_start)),
        lag_cycles=settings.lag_cycles,
        update_cycles=settings.update_cycles,
        **more,
    )


def check_view(setup: ConveyorSetup) -> None:
    """Raises DrakeTrackerError when a camera does not see the whole belt from its entry to the end of the window.

    Args:
        setup: the resolved scenario.
    """
    scenario = setup.scenario
    first, last = scenario.belt.entry, scenario.window.y_last
    (x0, y0), (x1, y1) = setup.belt_between(first, last)
    corners = np.array([[x, y, scenario.belt.height] for x in (x0, x1) for y in (y0, y1)])
    for side, camera in setup.belt_cameras.items():
        if not camera.sees(corners).all():
            raise DrakeTrackerError(
                f"{scenario.where('cameras')}: the {side} camera does not see the whole belt from belt.entry, "
                f"y = {first:g} m, to window.y_last, {last:g} m; move the cameras and calibrate them, or use !Measured"
            )


def conveyor_host(setup: ConveyorSetup) -> PickHostSystem:
    """Returns the host: estimator, dispatcher and orders as a System.

    Args:
        setup: the resolved scenario.
    """
    scenario = setup.scenario
    centres = cell_centres(scenario.tray)
    model = CycleModel(scenario.cycle, scenario.window)
    clerk = OrderClerk(
        make_dispatcher(scenario.dispatch, model, scenario.eligibility),
        model,
        [Cell(x, y) for x, y in centres],
        setup.filling_order,
    )
    host = PickHostSystem(
        BeltEstimator(scenario.estimator),
        clerk,
        [CellPose(x, y, scenario.belt.height, CELL_YAW) for x, y in centres],
        SEEKING,
        CARRYING,
        offset=vision_slot(ESTIMATOR_SLOT, scenario.time_step),
        has_encoder=scenario.belt.encoder,
        frame=scenario.belt.frame,
    )
    host.set_name("host")
    return host


def conveyor_link(setup: ConveyorSetup) -> LinkDiagram:
    """Returns the link, which carries packets and orders.

    Args:
        setup: the resolved scenario.
    """
    packets, orders = link_of(setup.scenario, setup.faults), link_of(setup.scenario, setup.faults, PickOrder)
    return LinkDiagram(packets, orders, "order")


def add_arm(setup: ConveyorSetup, builder: DiagramBuilder, decision: System | None = None) -> ArmDiagram:
    """Adds the computer of the arm: packet guard, servo, pick machine, transform equation and inverse kinematics.

    Args:
        setup: the resolved scenario.
        builder: of the diagram.
        decision: replaces the pick machine; None: it is made.
    """
    scenario, model = setup.scenario, setup.model
    if decision is None:
        slope = scenario.belt.frame.slope
        machine = PickMachine(scenario.pick, model, SERVO_PERIOD, setup.home, place_volume(setup), slope)
        decision = PickSystem(machine, scenario.time_step)
        decision.set_name("pick")
    return builder.AddSystem(
        ArmDiagram(
            decision,
            conveyor_guard(setup),
            scenario.servo,
            model,
            setup.q_initial,
            setup.home,
            scenario.time_step,
            jaw_opening=scenario.pick.jaw_opening,
            clearance=ArmClearance(setup.arm, [table_box(height=scenario.belt.height - table_below(scenario.belt))]),
            swings=True,
            slope=scenario.belt.frame.slope,
        )
    )


def place_volume(setup: ConveyorSetup) -> np.ndarray:
    """Returns the lowest and the highest corner in W of the box in which parts may be put down, shape (2, 3) [m].

    Args:
        setup: the resolved scenario.
    """
    tray, floor = setup.scenario.tray, setup.scenario.belt.height
    centres, half = cell_centres(tray), 0.5 * tray.cell
    low, high = centres.min(axis=0) - half, centres.max(axis=0) + half
    return np.array([[*low, floor], [*high, floor + HIGHEST_PART]])


def conveyor_guard(setup: ConveyorSetup) -> PacketGuard:
    """Returns the receiver of packets. Their paths begin on the belt, where it is seen.

    Args:
        setup: the resolved scenario.
    """
    belt, half = setup.scenario.belt, 0.5 * setup.scenario.belt.width + BESIDE_BELT
    ends = belt.frame.to_world(np.array([[0.0, y, belt.height, 0.0] for y in (belt.entry, belt.end)]))
    low, high = ends[:, 1:3].min(axis=0), ends[:, 1:3].max(axis=0)
    volume = [[belt.middle - half, *low], [belt.middle + half, high[0], high[1] + BESIDE_BELT]]
    return PacketGuard(setup.scenario.guard, np.array(volume), float(low[1]))
