import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    ArmCommand,
    GraspDiagnosis,
    JawState,
    Prediction,
    ServoTarget,
    ToolStatus,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import GRASP_SLOT, SERVO_PERIOD, SERVO_SLOT, TIME_STEP, servo_slot
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.grasp_system import GraspSystem
from drake_tracker.grasp.train.schema import Phase

PARAMETERS = GraspConfig(descent="blind", gate="auto")
TICK = servo_slot(GRASP_SLOT)
SPEED = 0.15


class Surroundings(LeafSystem):
    """A train on a straight track, perfectly predicted, and jaws that close on it as they are told.

    All functions of time, but for the packet, which comes new every servo period.
    """

    def __init__(self):
        super().__init__()
        self._width = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self.DeclareStateOutputPort("packet", self.DeclareDiscreteState(message_size(Prediction)))
        self.DeclareVectorOutputPort("target", message_size(ServoTarget), self._target)
        self.DeclareVectorOutputPort("status", message_size(ToolStatus), self._status)
        self.DeclareVectorOutputPort("jaws", message_size(JawState), self._jaws)
        self.DeclarePeriodicDiscreteUpdateEvent(SERVO_PERIOD, servo_slot(SERVO_SLOT), self._update)

    def _update(self, context, state):
        stamp = context.get_time() - 0.25
        if stamp > 0.2:
            times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            one = np.ones_like(times)
            knots = np.column_stack([0.56 * one, -0.6 + SPEED * times, 0.485 * one, np.pi / 2 * one, 0.002 * one])
            state.set_value(0, pack_prediction(stamp, 1, knots))

    def _target(self, context, output):
        due, stamp = context.get_time() + 0.045, context.get_time() - 0.25
        pose = [0.56, -0.6 + SPEED * due, 0.485, np.pi / 2]
        output.SetFromVector([due, *pose, 0.0, SPEED, 0.0, 0.0, stamp, 1, 0.002, 0, float(stamp > 0.2)])

    def _status(self, context, output):
        output.SetFromVector([1, 1, 0, 0, 0, 0, 0, 0])

    def _jaws(self, context, output):
        width = max(ArmCommand(self._width.Eval(context)).jaw_width, PARAMETERS.object_width)
        output.SetFromVector([width, 0.0, PARAMETERS.grip_force * (width == PARAMETERS.object_width)])


class Joints(LeafSystem):
    """Joint set-points with the hand over the train, worked out once for each period."""

    def __init__(self, model):
        super().__init__()
        self._rows = []
        q = PUMA560.q_start
        for k in range(170):
            y = -0.6 + SPEED * (k * SERVO_PERIOD + TICK + 0.045 - SERVO_PERIOD)
            if abs(y) < 0.3:
                q = joints_for(model, q, tool_down([0.56, y, 0.485 + PARAMETERS.hover_height], np.pi / 2))
            self._rows.append(np.array(q))
        self.DeclareVectorOutputPort("q", 6, self._calc)

    def _calc(self, context, output):
        output.SetFromVector(self._rows[min(int(context.get_time() / SERVO_PERIOD), len(self._rows) - 1)])


@pytest.fixture(scope="module")
def diagram(arm_model):
    builder = DiagramBuilder()
    grasp = builder.AddNamedSystem("grasp", GraspSystem(GraspMachine(PARAMETERS, arm_model, SERVO_PERIOD, 0.485)))
    world = builder.AddNamedSystem("world", Surroundings())
    joints = builder.AddNamedSystem("joints", Joints(arm_model))
    for name in ("target", "packet", "jaws", "status"):
        builder.Connect(world.GetOutputPort(name), grasp.GetInputPort(name))
    builder.Connect(joints.GetOutputPort("q"), grasp.GetInputPort("q_commanded"))
    builder.Connect(grasp.GetOutputPort("command"), world.GetInputPort("command"))
    builder.ExportOutput(grasp.GetOutputPort("command"), "command")
    builder.ExportOutput(grasp.GetOutputPort("diagnosis"), "diagnosis")
    return builder.Build()


def ticks(diagram, simulator, count):
    """Commands and diagnoses just after each of the first ticks."""
    commands, diagnoses = [], []
    for k in range(count):
        simulator.AdvanceTo(k * SERVO_PERIOD + TICK + 0.02 * TIME_STEP)
        commands.append(diagram.GetOutputPort("command").Eval(simulator.get_context()).copy())
        diagnoses.append(diagram.GetOutputPort("diagnosis").Eval(simulator.get_context()).copy())
    return ArmCommand(np.array(commands).T), GraspDiagnosis(np.array(diagnoses).T)


def test_it_grasps_an_object_on_an_open_track(diagram):
    commands, diagnoses = ticks(diagram, Simulator(diagram), 165)
    phases = [Phase(int(phase)) for phase in commands.phase]
    order = [phases[0]] + [b for a, b in zip(phases, phases[1:]) if a != b]
    assert order == [Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE, Phase.LIFT, Phase.HOLD]
    gates = [Gate(int(gate)) for gate, phase in zip(diagnoses.gate, phases) if phase == Phase.TRACK]
    assert gates[1] == gates[40] == Gate.SETTLING  # 1.5 s
    assert diagnoses.attempts[-1] == 1.0 and diagnoses.records[-1] > 3
    assert np.all(np.diff(diagnoses.records) >= 0.0)
    assert commands.jaw_width[0] == PARAMETERS.jaw_opening and commands.jaw_width[-1] < PARAMETERS.object_width
    np.testing.assert_array_equal(diagnoses.phase, commands.phase)


def test_before_the_first_tick_it_commands_to_wait_with_open_jaws(diagram):
    context = diagram.CreateDefaultContext()
    command = ArmCommand(diagram.GetOutputPort("command").Eval(context))
    assert (command.phase, command.motion, command.jaw_width) == (Phase.ACQUIRE, 0.0, PARAMETERS.jaw_opening)


def test_it_ticks_in_its_slot_once_a_period(diagram):
    simulator = Simulator(diagram)
    changed = set()
    port, context = diagram.GetOutputPort("diagnosis"), simulator.get_context()
    for k in range(70):
        before = port.Eval(context).copy()
        simulator.AdvanceTo(k * SERVO_PERIOD + TICK - 0.02 * TIME_STEP)
        if not np.array_equal(port.Eval(context), before):
            changed.add("elsewhere")
        before = port.Eval(context).copy()
        simulator.AdvanceTo(k * SERVO_PERIOD + TICK + 0.02 * TIME_STEP)
        if not np.array_equal(port.Eval(context), before):
            changed.add("tick")
    assert changed == {"tick"}


def test_outputs_are_state_and_a_clone_replays(diagram, arm_model):
    assert not GraspSystem(GraspMachine(PARAMETERS, arm_model, SERVO_PERIOD, 0.485)).HasAnyDirectFeedthrough()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.5)
    clone = Simulator(diagram, simulator.get_context().Clone())
    ends = []
    for each in (simulator, clone):
        each.AdvanceTo(3.0)
        ends.append(
            np.hstack([diagram.GetOutputPort(name).Eval(each.get_context()) for name in ("command", "diagnosis")])
        )
    np.testing.assert_array_equal(*ends)
