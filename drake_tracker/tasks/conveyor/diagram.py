"""Builds the hand-eye diagram of the conveyor from a scenario."""

import math

import numpy as np

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import PickOrder
from drake_tracker.core.timing import ESTIMATOR_SLOT, SERVO_PERIOD, vision_slot
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.diagrams.hand_eye import WITH_ENCODER, WITH_ORDERS, HandEyeDiagram
from drake_tracker.diagrams.parts import link_of
from drake_tracker.dispatch.candidate import Cell
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.kinds import make_dispatcher
from drake_tracker.dispatch.order_tracker import OrderClerk
from drake_tracker.dispatch.pick_host_system import CellPose, PickHostSystem
from drake_tracker.estimation.belt import BeltEstimator
from drake_tracker.faults.fault import Fault
from drake_tracker.faults.kinds import make_faults
from drake_tracker.grasp.conveyor.pick_machine import PickMachine
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.grasp.conveyor.pick_system import PickSystem
from drake_tracker.link.link_diagram import LinkDiagram
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.conveyor.vision_parts import image_pipeline, make_vision
from drake_tracker.world.conveyor.arrivals import Arrival, draw_arrivals
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_plant import TABLE_BELOW
from drake_tracker.world.conveyor.conveyor_world_diagram import ConveyorWorldDiagram
from drake_tracker.world.conveyor.tray import cell_centres
from drake_tracker.world.train.plant import table_box

SEEKING = (PickPhase.WAIT, PickPhase.TRACK)
"""Phases in which the hand has not yet begun to descend."""
CARRYING = (PickPhase.CARRY, PickPhase.LOWER, PickPhase.RELEASE, PickPhase.RAISE)
"""Phases in which it carries a part, puts it down or comes back."""
CELL_YAW = 0.5 * np.pi
"""Direction of x_P of a part in its cell [rad]: the jaws open across the columns, where neighbours leave room."""
PART_HEIGHT = 0.015
"""Height of the origin of a part above the belt, for the pose in which the hand waits [m]."""
HIGHEST_PART = 0.05
"""Largest height of the origin of a part above the floor of its cell [m]."""
BESIDE_BELT = 0.02
"""Distance beside and above the belt up to which a packet may begin [m]."""


def make_conveyor_diagram(scenario: ConveyorScenario) -> HandEyeDiagram:
    """Returns the hand-eye diagram of a scenario.

    Args:
        scenario: the scenario. All random numbers are drawn from its ``seed``.

    Raises DrakeTrackerError when the scenario cannot be built.
    """
    arrivals = arrivals_of(scenario)
    if not arrivals:
        raise DrakeTrackerError(
            f"{scenario.where('duration')}: no part arrives within {scenario.duration:g} s with seed {scenario.seed}; "
            "choose a longer run, or a larger arrivals.rate"
        )
    description = arm_of(scenario)
    model = make_arm_model(description)
    home = home_reference(scenario)
    over_home = tool_down(home[:3] + [0.0, 0.0, scenario.pick.hover_height], home[3])
    q_initial = joints_for(model, description.q_start, over_home)
    q_initial[-1] = math.remainder(q_initial[-1], math.pi)  # jaws are the same after half a turn
    pipeline = image_pipeline(scenario)
    vision, windows = make_vision(scenario, arrivals, pipeline)
    world = ConveyorWorldDiagram(
        description=description,
        q_initial=q_initial,
        arrivals=arrivals,
        duration=scenario.duration,
        belt=scenario.belt,
        tray=scenario.tray,
        grip_force=scenario.pick.grip_force,
        jaw_opening=scenario.pick.jaw_opening,
        cameras=scenario.cameras,
        lighting=scenario.lighting,
        windows=windows,
        pipeline=pipeline,
        faults=conveyor_faults(scenario),
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
    link = conveyor_link(scenario)
    decision = PickSystem(
        PickMachine(scenario.pick, model, SERVO_PERIOD, home, place_volume(scenario)), scenario.time_step
    )
    decision.set_name("pick")
    arm = ArmDiagram(
        decision,
        conveyor_guard(scenario),
        scenario.servo,
        model,
        q_initial,
        home,
        scenario.time_step,
        jaw_opening=scenario.pick.jaw_opening,
        clearance=ArmClearance(description, [table_box(height=scenario.belt.height - TABLE_BELOW)]),
        swings=True,
    )
    connections = (*WITH_ORDERS, *WITH_ENCODER) if scenario.belt.encoder else WITH_ORDERS
    return HandEyeDiagram(world, vision, conveyor_host(scenario), link, arm, connections)


def conveyor_faults(scenario: ConveyorScenario) -> tuple[Fault, ...]:
    """Returns what goes wrong in a scenario."""
    if not scenario.faults:
        return ()
    description = arm_of(scenario)
    return make_faults(
        scenario.faults,
        seed=scenario.seed,
        servo_inertia=description.servo_inertia,
        finger_stiffness=description.finger_stiffness,
        time_step=scenario.time_step,
        belt_middle=scenario.belt.middle,
        belt_height=scenario.belt.height,
    )


def arrivals_of(scenario: ConveyorScenario) -> tuple[Arrival, ...]:
    """Returns the parts that arrive in a run, in the order of their arrival."""
    motion = make_belt_motion(scenario.belt)
    return draw_arrivals(
        scenario.arrivals, belt=scenario.belt, motion=motion, duration=scenario.duration, seed=scenario.seed
    )


def home_reference(scenario: ConveyorScenario) -> np.ndarray:
    """Returns the reference (x, y, z, yaw) in W over which the hand waits [m, rad], shape (4,)."""
    y, z = scenario.window.y_wait, scenario.belt.height + PART_HEIGHT
    return np.array([scenario.belt.middle, y, z, CELL_YAW])


def filling_order(scenario: ConveyorScenario) -> list[int]:
    """Returns the numbers of the cells in the order in which they are filled.

    The tray that is nearer to the waiting hand comes first. In a tray, y decreases from row to row: the jaws hold an
    ell beside its middle, and stand over the edge of the next cell towards -y, which must still be empty.
    """
    x, y = cell_centres(scenario.tray).T
    farther = np.abs(np.sign(y) - np.sign(scenario.window.y_wait)) > 1.0
    return np.lexsort((x, -y.round(6), farther)).tolist()


def place_volume(scenario: ConveyorScenario) -> np.ndarray:
    """Returns the lowest and the highest corner in W of the box in which parts may be put down, shape (2, 3) [m]."""
    centres, half, floor = cell_centres(scenario.tray), 0.5 * scenario.tray.cell, scenario.belt.height
    low, high = centres.min(axis=0) - half, centres.max(axis=0) + half
    return np.array([[*low, floor], [*high, floor + HIGHEST_PART]])


def conveyor_host(scenario: ConveyorScenario) -> PickHostSystem:
    """Returns the host of a scenario: estimator, dispatcher and orders as a System."""
    centres = cell_centres(scenario.tray)
    model = CycleModel(scenario.cycle, scenario.window)
    clerk = OrderClerk(
        make_dispatcher(scenario.dispatch, model, scenario.eligibility),
        model,
        [Cell(x, y) for x, y in centres],
        filling_order(scenario),
    )
    host = PickHostSystem(
        BeltEstimator(scenario.estimator),
        clerk,
        [CellPose(x, y, scenario.belt.height, CELL_YAW) for x, y in centres],
        SEEKING,
        CARRYING,
        offset=vision_slot(ESTIMATOR_SLOT, scenario.time_step),
        has_encoder=scenario.belt.encoder,
    )
    host.set_name("host")
    return host


def conveyor_link(scenario: ConveyorScenario) -> LinkDiagram:
    """Returns the link of a scenario, which carries packets and orders."""
    faults = conveyor_faults(scenario)
    return LinkDiagram(link_of(scenario, faults), link_of(scenario, faults, PickOrder), "order")


def conveyor_guard(scenario: ConveyorScenario) -> PacketGuard:
    """Returns the receiver of a scenario's packets. Their paths begin on the belt, where it is seen."""
    belt, half = scenario.belt, 0.5 * scenario.belt.width + BESIDE_BELT
    volume = [
        [belt.middle - half, belt.entry, belt.height],
        [belt.middle + half, belt.end, belt.height + BESIDE_BELT],
    ]
    return PacketGuard(scenario.guard, np.array(volume), belt.height)
