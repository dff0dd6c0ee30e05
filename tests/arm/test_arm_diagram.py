import numpy as np
import pytest
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.config import PacketGuardConfig, ServoConfig
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.servo import Servo
from drake_tracker.arm.motion.servo_system import ServoSystem
from drake_tracker.arm.motion.tool_controller import DifferentialIkSystem, TransformEquationSystem
from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.arm.plant import actuators_of, add_arm, couple_fingers, set_servo_gains
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    ArmCommand,
    GraspDiagnosis,
    JawState,
    Prediction,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import (
    ESTIMATOR_SLOT,
    GRASP_SLOT,
    GUARD_SLOT,
    IK_SLOT,
    LIMITER_SLOT,
    LINK_SLOT,
    SERVO_PERIOD,
    SERVO_SLOT,
    TIME_STEP,
    TRANSFORM_SLOT,
    VISION_PERIOD,
    servo_slot,
    vision_slot,
)
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.grasp_system import GraspSystem
from drake_tracker.grasp.train.schema import Phase

RADIUS, SPEED, LAG = 0.12, 0.15, 0.25
HOME = np.array([0.56, 0.0, 0.485, np.pi])
GRASP = GraspConfig(descent="blind", gate="auto")
VOLUME = np.array([[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]])


def make_arm(model, q_initial, time_step=TIME_STEP, period=SERVO_PERIOD):
    grasp = GraspSystem(GraspMachine(GRASP, model, period, 0.485), time_step, period)
    guard, servo = PacketGuard(PacketGuardConfig(), VOLUME, 0.45), ServoConfig()
    return ArmDiagram(grasp, guard, servo, model, q_initial, HOME, time_step, period, jaw_opening=GRASP.jaw_opening)


def object_at(t):
    """Poses (x, y, z, yaw) on the circle, shape (..., 4)."""
    a = SPEED / RADIUS * np.asarray(t)
    x, y = 0.56 + RADIUS * np.cos(a), RADIUS * np.sin(a)
    return np.stack(np.broadcast_arrays(x, y, 0.485, a + np.pi / 2), axis=-1)


class Packets(LeafSystem):
    """Perfect packets of the circle, late by the lag of vision, until ``until`` [s]."""

    def __init__(self, until=np.inf):
        super().__init__()
        self._until = until
        self.DeclareStateOutputPort("packet", self.DeclareDiscreteState(message_size(Prediction)))
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, vision_slot(LINK_SLOT), self._update)

    def _update(self, context, state):
        now = context.get_time()
        if 0.3 < now < self._until:
            stamp = now - LAG
            times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([object_at(times), np.full(KNOT_COUNT, 0.02)])
            state.set_value(0, pack_prediction(stamp, round(now / VISION_PERIOD), knots))


@pytest.fixture(scope="module")
def q_initial(arm_model):
    return joints_for(arm_model, PUMA560.q_start, tool_down(HOME[:3] + [0.0, 0.0, GRASP.hover_height], HOME[3]))


def simulate(arm_model, q_initial, duration, until=np.inf, time_step=TIME_STEP, period=SERVO_PERIOD):
    """The arm's computer and the arm alone. Returns logs {name: (times, rows)} at every plant step."""
    builder = DiagramBuilder()
    plant = MultibodyPlant(time_step)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
    parts = add_arm(plant, description=PUMA560)
    couple_fingers(plant, parts.gripper, PUMA560)
    set_servo_gains(plant, parts.arm, PUMA560.servo_inertia, PUMA560.servo_bandwidth)
    plant.Finalize()
    plant.SetDefaultPositions(parts.arm, q_initial)
    plant.SetDefaultPositions(parts.gripper, [0.5 * GRASP.jaw_opening] * 2)
    builder.AddSystem(plant)
    packets = builder.AddSystem(Packets(until))
    arm = builder.AddSystem(make_arm(arm_model, q_initial, time_step, period))
    builder.Connect(packets.GetOutputPort("packet"), arm.GetInputPort("packet"))
    builder.Connect(plant.get_state_output_port(parts.arm), arm.GetInputPort("arm_state"))
    builder.Connect(arm.GetOutputPort("arm_desired_state"), plant.get_desired_state_input_port(parts.arm))
    builder.Connect(arm.GetOutputPort("arm_feedforward"), plant.get_actuation_input_port(parts.arm))
    builder.Connect(arm.GetOutputPort("gripper_desired_state"), plant.get_desired_state_input_port(parts.gripper))
    ports = {
        "arm_state": plant.get_state_output_port(parts.arm),
        "effort": plant.get_net_actuation_output_port(parts.arm),
        **{name: arm.GetOutputPort(name) for name in ("target", "command", "status", "diagnosis", "q_commanded")},
    }
    logs = {name: LogVectorOutput(port, builder, publish_period=time_step) for name, port in ports.items()}
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    jaws = [GRASP.jaw_opening, 0.0, 0.0]
    arm.GetInputPort("jaws").FixValue(arm.GetMyContextFromRoot(context), jaws)
    Simulator(diagram, context).AdvanceTo(duration)
    found = {name: log.FindLog(context) for name, log in logs.items()}
    limits = np.array([actuator.effort_limit() for actuator in actuators_of(plant, parts.arm)])
    return {name: (log.sample_times(), log.data().T) for name, log in found.items()}, limits


@pytest.fixture(scope="module")
def run(arm_model, q_initial):
    """Three seconds of packets, then none."""
    return simulate(arm_model, q_initial, 5.1, until=3.0)


def test_the_hand_hovers_over_the_true_object_despite_late_packets(run, arm_model):
    times, state = run[0]["arm_state"]
    hovering = np.flatnonzero((times > 2.0) & (times < 4.0))[::5]
    tool = np.array([arm_model.tool_pose(state[i, :6]).translation() for i in hovering])
    truth = object_at(times[hovering])[:, :3] + [0.0, 0.0, GRASP.hover_height]
    error = np.linalg.norm(tool - truth, axis=1)
    assert np.sqrt(np.mean(error**2)) < 2e-3
    assert np.max(error) < 4e-3


def test_the_jaws_lie_along_the_path(run, arm_model):
    times, state = run[0]["arm_state"]
    status = run[0]["status"][1]
    settled = np.flatnonzero((times > 2.0) & (times < 4.0) & (status[:, 2] == 0.0))[::10]
    for i in settled:
        x_axis = arm_model.tool_pose(state[i, :6]).rotation().matrix()[:, 0]
        yaw = object_at(times[i])[3]
        assert abs(x_axis[:2] @ [np.cos(yaw), np.sin(yaw)]) > np.cos(np.deg2rad(3.0))


def test_at_a_period_of_5_ms_it_tracks_as_well(arm_model, q_initial):
    """The manipulator's period of Nashman and Chaconas 1990, three plant steps of 1/600 s."""
    logs, limits = simulate(arm_model, q_initial, 2.4, time_step=1.0 / 600.0, period=0.005)
    times, state = logs["arm_state"]
    late = np.flatnonzero(times > 2.0)[::10]
    tool = np.array([arm_model.tool_pose(state[i, :6]).translation() for i in late])
    truth = object_at(times[late])[:, :3] + [0.0, 0.0, GRASP.hover_height]
    assert np.max(np.linalg.norm(tool - truth, axis=1)) < 3e-3
    assert np.all(np.abs(logs["effort"][1]) < limits)
    times, q = logs["q_commanded"]
    changed = times[1:][np.any(np.diff(q, axis=0) != 0.0, axis=1)]
    assert np.median(np.diff(changed)) == pytest.approx(0.005)


def test_phases_follow_what_is_seen_and_the_gate_waits_for_a_memory(run):
    times, diagnosis = run[0]["diagnosis"]
    phase = GraspDiagnosis(diagnosis.T).phase
    assert set(phase[times < 0.3]) == {Phase.ACQUIRE}
    assert set(phase[(times > 0.65) & (times < 4.0)]) == {Phase.TRACK}
    gate = diagnosis[(times > 2.4) & (times < 3.0), 2]
    assert Gate.OPEN not in gate and Gate.NO_MEMORY in gate
    assert np.all(diagnosis[:, 1] == 0.0)


def test_without_packets_it_coasts_for_a_second_and_then_stands_still_above(run, arm_model):
    logs, _ = run
    times, target = logs["target"]
    assert np.all(target[(times > 3.3) & (times < 4.4), -2] == 1.0)  # stale
    assert target[-1, -1] == 0.0  # no longer valid
    times, diagnosis = logs["diagnosis"]
    hovering = times[diagnosis[:, 0] == Phase.HOVER]
    assert hovering[0] == pytest.approx(3.0 + GRASP.silence, abs=VISION_PERIOD + 2 * SERVO_PERIOD)
    assert hovering[-1] == times[-1]
    tool = arm_model.tool_pose(logs["arm_state"][1][-1, :6]).translation()
    assert tool[2] == pytest.approx(0.485 + GRASP.hover_height, abs=2e-3)
    assert np.linalg.norm(tool[:2] - object_at(hovering[0])[:2]) < 0.05
    assert np.max(np.abs(logs["arm_state"][1][-1, 6:])) < 2e-3  # at rest
    assert all(np.all(np.isfinite(rows)) for _, rows in logs.values())


def test_no_limit_is_touched(run, arm_model):
    logs, limits = run
    state = logs["arm_state"][1]
    assert np.all(np.abs(state[:, 6:]) < arm_model.velocity_limit)
    assert np.all((state[:, :6] > arm_model.position_lower) & (state[:, :6] < arm_model.position_upper))
    assert np.all(np.abs(logs["effort"][1]) < limits)


def test_it_stands_still_until_something_is_seen(run):
    times, state = run[0]["arm_state"]
    assert np.max(np.abs(state[times < 0.5, 6:])) < 2e-3


def test_the_slots_of_the_servo_period_follow_each_other_before_its_end():
    slots = [servo_slot(slot) for slot in (SERVO_SLOT, GRASP_SLOT, TRANSFORM_SLOT, IK_SLOT, LIMITER_SLOT)]
    last_step = SERVO_PERIOD - TIME_STEP
    assert np.all(np.diff([last_step, *slots, SERVO_PERIOD]) > 0.03 * TIME_STEP)
    assert round(SERVO_PERIOD / TIME_STEP) * TIME_STEP == pytest.approx(SERVO_PERIOD, rel=1e-12)
    # whatever plant step they fall in, the estimator, the link and the packet guard have had theirs
    assert vision_slot(ESTIMATOR_SLOT) < vision_slot(LINK_SLOT) < vision_slot(GUARD_SLOT) < SERVO_SLOT * TIME_STEP


def test_each_output_changes_in_its_own_slot_and_nowhere_else(arm_model, q_initial):
    builder = DiagramBuilder()
    packets = builder.AddSystem(Packets())
    arm = builder.AddSystem(make_arm(arm_model, q_initial))
    builder.Connect(packets.GetOutputPort("packet"), arm.GetInputPort("packet"))
    inputs = {arm.get_input_port(i).get_name() for i in range(arm.num_input_ports())}
    assert inputs == {"packet", "arm_state", "arm_effort", "jaws", "operator"}
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    inside = arm.GetMyContextFromRoot(context)
    arm.GetInputPort("arm_state").FixValue(inside, [*q_initial, *np.zeros(6)])
    arm.GetInputPort("jaws").FixValue(inside, [GRASP.jaw_opening, 0.0, 0.0])
    simulator = Simulator(diagram, context)
    expected = {
        "target": SERVO_SLOT,
        "command": GRASP_SLOT,
        "status": TRANSFORM_SLOT,
        "q_commanded": LIMITER_SLOT,
        "arm_desired_state": None,
    }
    seen = {name: set() for name in expected}
    slots = [SERVO_SLOT, GRASP_SLOT, TRANSFORM_SLOT, IK_SLOT, LIMITER_SLOT]
    values = {}
    for k in range(27):
        for slot in slots:  # what changed since just after the slot before
            simulator.AdvanceTo(k * SERVO_PERIOD + servo_slot(slot) + 0.02 * TIME_STEP)
            for name in expected:
                value = arm.GetOutputPort(name).Eval(inside).copy()
                if name in values and not np.array_equal(values[name], value):
                    seen[name].add(slot)
                values[name] = value
    for name, slot in expected.items():
        if slot is not None:
            assert seen[name] == {slot}, name
    assert SERVO_SLOT in seen["arm_desired_state"]  # the spline moves on all the time


def in_order(arm_model, q_initial, order):
    """The four Systems of the servo period with a source of packets, added in the given order. Returns their log."""
    systems = {
        "packets": Packets(),
        "servo": ServoSystem(Servo(lead=0.04)),
        "grasp": GraspSystem(GraspMachine(GRASP, arm_model, SERVO_PERIOD, 0.485)),
        "transform": TransformEquationSystem(ToolMotion(HOME, SERVO_PERIOD), arm_model, q_initial),
        "ik": DifferentialIkSystem(arm_model, q_initial),
    }
    builder = DiagramBuilder()
    for name in order:
        builder.AddNamedSystem(name, systems[name])
    for out, port, *inputs in (
        ("packets", "packet", ("servo", "packet")),
        ("servo", "target", ("grasp", "target"), ("transform", "target")),
        ("servo", "held_packet", ("grasp", "packet")),
        ("grasp", "command", ("servo", "command"), ("transform", "command")),
        ("transform", "status", ("grasp", "status")),
        ("transform", "X_WT_desired", ("ik", "X_WT_desired")),
        ("ik", "q_commanded", ("transform", "q_commanded"), ("grasp", "q_commanded")),
    ):
        for name, inlet in inputs:
            builder.Connect(systems[out].GetOutputPort(port), systems[name].GetInputPort(inlet))
    logs = [
        LogVectorOutput(systems[name].GetOutputPort(port), builder, publish_period=TIME_STEP)
        for name, port in (("ik", "q_commanded"), ("grasp", "command"), ("transform", "status"), ("servo", "target"))
    ]
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    grasp = systems["grasp"]
    grasp.GetInputPort("jaws").FixValue(grasp.GetMyContextFromRoot(context), np.zeros(message_size(JawState)))
    Simulator(diagram, context).AdvanceTo(1.5)
    return np.vstack([log.FindLog(context).data() for log in logs])


def test_the_order_in_which_systems_are_added_does_not_matter(arm_model, q_initial):
    order = ["packets", "servo", "grasp", "transform", "ik"]
    first = in_order(arm_model, q_initial, order)
    np.testing.assert_array_equal(in_order(arm_model, q_initial, order[::-1]), first)
    mixed = in_order(arm_model, q_initial, ["grasp", "ik", "packets", "transform", "servo"])
    np.testing.assert_array_equal(mixed, first)
    assert ArmCommand(first[6:13, -1]).phase == Phase.TRACK  # it was doing something
