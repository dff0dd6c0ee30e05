"""The cup is there when the ball comes: the arm's own computer at 5 ms, without a world."""

import numpy as np
import pytest
from catches import PERIOD, TIME_STEP, ball_packet, edge
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.servo import Servo
from drake_tracker.arm.motion.servo_system import ServoSystem
from drake_tracker.arm.motion.tool_controller import DifferentialIkSystem, TransformEquationSystem
from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.core.messages import CatchDiagnosis, Prediction, message_size
from drake_tracker.core.timing import LINK_SLOT, vision_slot
from drake_tracker.grasp.ball.catch_machine import CatchMachine
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.ball.catch_system import CatchSystem
from drake_tracker.grasp.config import CatchConfig

PARAMETERS = CatchConfig()
NEWS = 4.0 / 60.0
LAG = 0.1


class Operator(LeafSystem):
    """Says what a function of the time [s] returns."""

    def __init__(self, says):
        super().__init__()
        self.DeclareVectorOutputPort(
            "says", 6, lambda context, output: output.SetFromVector([*says(context.get_time()), 0.0])
        )


class Packets(LeafSystem):
    """New packets every four cycles, late by the throughput, of a ball that comes at ``arrival`` [s] at ``x(now)``."""

    def __init__(self, arrival, x, start, end=np.inf):
        super().__init__()
        self._arrival, self._x, self._span = arrival, x, (start, end)
        self.DeclareStateOutputPort("packet", self.DeclareDiscreteState(message_size(Prediction)))
        self.DeclarePeriodicDiscreteUpdateEvent(NEWS, vision_slot(LINK_SLOT, TIME_STEP), self._update)

    def _update(self, context, state):
        now = context.get_time()
        if self._span[0] <= now < min(self._span[1], self._arrival + LAG):
            state.set_value(0, ball_packet(now - LAG, self._arrival, self._x(now), seq=round(now / NEWS)))


def run(arm_model, packets, duration, operator=None):
    """Returns times, tool positions (n, 3) of the joint set-points, diagnosis, ready, joint set-points."""
    board = edge()
    home = board.home
    q = joints_for(arm_model, PUMA560.q_start, tool_down(home[:3] + [0.0, 0.0, PARAMETERS.rim_height], home[3]))
    builder = DiagramBuilder()
    source = builder.AddSystem(packets)
    servo = builder.AddSystem(ServoSystem(Servo(lead=0.01), TIME_STEP, PERIOD))
    catch = builder.AddSystem(CatchSystem(CatchMachine(PARAMETERS, board, PERIOD), TIME_STEP, PERIOD))
    motion = ToolMotion(home, PERIOD, moving=False, symmetric=False)
    transform = builder.AddSystem(TransformEquationSystem(motion, arm_model, q, TIME_STEP, PERIOD))
    ik = builder.AddSystem(DifferentialIkSystem(arm_model, q, TIME_STEP, PERIOD))
    for out, port, into, inlet in (
        (source, "packet", servo, "packet"),
        (servo, "target", catch, "target"),
        (servo, "held_packet", catch, "packet"),
        (catch, "command", servo, "command"),
        (catch, "command", transform, "command"),
        (catch, "object", transform, "target"),
        (transform, "status", catch, "status"),
        (transform, "X_WT_desired", ik, "X_WT_desired"),
        (ik, "q_commanded", transform, "q_commanded"),
    ):
        builder.Connect(out.GetOutputPort(port), into.GetInputPort(inlet))
    if operator is not None:
        builder.Connect(builder.AddSystem(operator).get_output_port(), catch.GetInputPort("operator"))
    outputs = [ik.get_output_port(), catch.GetOutputPort("diagnosis"), catch.GetOutputPort("ready")]
    logs = [LogVectorOutput(port, builder, publish_period=PERIOD) for port in outputs]
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    Simulator(diagram, context).AdvanceTo(duration)
    found = [log.FindLog(context) for log in logs]
    q_all, diagnosis, ready = (log.data() for log in found)
    tool = np.array([arm_model.tool_pose(row).translation() for row in q_all.T])
    return found[0].sample_times(), tool, CatchDiagnosis(diagnosis), ready[0], q_all


def wanted(x):
    return edge().place(x)[:3] + [0.0, 0.0, PARAMETERS.rim_height]


@pytest.mark.parametrize("x, jump", [(0.10, -0.15), (-0.25, 0.15)])
def test_it_reaches_a_crossing_that_jumps_six_tenths_before_the_arrival(arm_model, x, jump):
    arrival = 1.6
    packets = Packets(arrival, lambda now: x if now < arrival - 0.6 else x + jump, start=0.4)
    times, tool, diagnosis, _, q = run(arm_model, packets, 2.8)
    error = np.linalg.norm(tool - wanted(x + jump), axis=1)
    assert np.all(error[(times > arrival - 0.15) & (times < arrival + 0.35)] < 0.010)
    still = (times > arrival - 0.03) & (times < arrival + 0.35)
    speed = np.linalg.norm(np.gradient(tool, PERIOD, axis=0), axis=1)
    assert np.max(speed[still]) < 0.02
    raised = wanted(x + jump) + [0.0, 0.0, PARAMETERS.raised_height - PARAMETERS.rim_height]
    assert np.linalg.norm(tool[-1] - raised) < 0.002
    phases = [CatchPhase(int(phase)) for phase in diagnosis.phase]
    order = [phases[0]] + [after for before, after in zip(phases, phases[1:]) if before != after]
    assert order == [phase for phase in CatchPhase if phase <= CatchPhase.HOLD]
    assert np.all(abs(np.diff(q, axis=1)) <= arm_model.velocity_limit[:, None] * PERIOD)


def test_the_operator_stops_the_hand_in_its_motion_and_moves_it(arm_model):
    """Stop at 0.6 s, while the hand is under way; take over at 1.0 s; let go at 2.2 s."""
    pose = np.array([0.48, 0.10, 0.60, np.pi + 0.3])

    def says(now):
        mode = 0.0 if now < 0.6 or now >= 2.2 else 1.0 if now < 1.0 else 2.0
        return [mode, *pose] if mode == 2.0 else [mode, 0.0, 0.0, 0.0, 0.0]

    packets = Packets(1.5, lambda now: -0.2, start=0.4, end=0.9)
    times, tool, diagnosis, ready, _ = run(arm_model, packets, 3.9, Operator(says))
    way = np.linalg.norm(tool - tool[np.searchsorted(times, 0.6)], axis=1)
    speed = np.linalg.norm(np.gradient(tool, PERIOD, axis=0), axis=1)
    assert speed[np.searchsorted(times, 0.6)] > 0.3  # it was fast
    stopped = (times > 0.83) & (times < 1.0)
    assert np.max(speed[stopped]) < 0.01 and np.max(way[stopped]) < 0.05
    assert np.linalg.norm(tool[np.searchsorted(times, 2.2)] - pose[:3]) < 0.002
    assert np.max(speed[(times > 1.0) & (times < 2.2)]) < 0.30
    assert np.linalg.norm(tool[-1] - wanted(0.0)) < 0.002  # home again
    assert diagnosis.phase[-1] == CatchPhase.WAIT
    assert not np.any(ready[(times > 0.6) & (times < 3.2)]) and ready[-1] == 1.0
