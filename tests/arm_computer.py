"""The computer of the PUMA alone, which receives packets from a test. Its joints stand still."""

import numpy as np
from packets import TABLE_HEIGHT, VOLUME
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.config import PacketGuardConfig, ServoConfig
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.messages import Prediction, message_size
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP, VISION_PERIOD
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.grasp_system import GraspSystem

HOME = np.array([0.56, 0.0, 0.485, np.pi])
GUARD = PacketGuard(PacketGuardConfig(), VOLUME, TABLE_HEIGHT)
PORTS = ("target", "command", "status", "q_commanded", "arm_desired_state", "packet_report")


class Sender(LeafSystem):
    """Sends packet ``make(now, number)`` in each vision cycle."""

    def __init__(self, make):
        super().__init__()
        self._make = make
        self.DeclareStateOutputPort("packet", self.DeclareDiscreteState(message_size(Prediction)))
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, 0.5 * TIME_STEP, self._update)

    def _update(self, context, state):
        now = context.get_time()
        state.set_value(0, self._make(now, round(now / VISION_PERIOD)))


class ArmComputer:
    """Runs the arm's computer.

    Attributes:
        model: the controller's model of the arm.
        q_initial: joints with the hand over `HOME` [rad].
    """

    def __init__(self):
        self.model = make_arm_model(PUMA560)
        waiting = tool_down(HOME[:3] + [0.0, 0.0, GraspConfig().hover_height], HOME[3])
        self.q_initial = joints_for(self.model, PUMA560.q_start, waiting)

    def run(self, make, duration):
        """Returns {port: (times, rows)} of a run in which ``make(now, number)`` is the packet of each vision cycle."""
        builder = DiagramBuilder()
        grasp = GraspSystem(GraspMachine(GraspConfig(descent="blind", gate="auto"), self.model, SERVO_PERIOD, HOME[2]))
        arm = builder.AddSystem(ArmDiagram(grasp, GUARD, ServoConfig(), self.model, self.q_initial, HOME, TIME_STEP))
        builder.Connect(builder.AddSystem(Sender(make)).GetOutputPort("packet"), arm.GetInputPort("packet"))
        logs = {name: LogVectorOutput(arm.GetOutputPort(name), builder, publish_period=SERVO_PERIOD) for name in PORTS}
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        inside = arm.GetMyContextFromRoot(context)
        arm.GetInputPort("arm_state").FixValue(inside, [*self.q_initial, *np.zeros(6)])
        arm.GetInputPort("jaws").FixValue(inside, [GraspConfig().jaw_opening, 0.0, 0.0])
        Simulator(diagram, context).AdvanceTo(duration)
        found = {name: log.FindLog(context) for name, log in logs.items()}
        return {name: (log.sample_times(), log.data().T) for name, log in found.items()}
