"""The arm's computer with cameras that are wrong by a constant: the hand is over the object only if they see it, too.

Nothing is rendered. The joints are where they are commanded to be.
"""

import numpy as np
import pytest
from packets import TABLE_HEIGHT, VOLUME, circle_packet, with_knots
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput
from variants import variant

from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.config import HandEyeConfig, PacketGuardConfig, ServoConfig
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.hand_eye_correction import HandEyeCorrection
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.core.messages import HandCorrection, HandPoint, Prediction, message_size
from drake_tracker.core.timing import LINK_SLOT, SERVO_PERIOD, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.grasp_system import GraspSystem
from drake_tracker.vision.delay_line_system import DelayLineSystem

BIAS = np.array([-0.020, 0.018, 0.006])
HOME = np.array([0.56, 0.0, 0.485, np.pi])
LAG = 15


class WrongCameras(LeafSystem):
    """Sees object and hand displaced by `BIAS`; the hand until ``hidden`` [s] only."""

    def __init__(self, model, hidden=np.inf):
        super().__init__()
        self._model, self._hidden = model, hidden
        self._arm_state = self.DeclareVectorInputPort("arm_state", 12)
        self.DeclareVectorOutputPort("packet", message_size(Prediction), self._calc_packet)
        self.DeclareVectorOutputPort("hand_point", message_size(HandPoint), self._calc_hand_point)

    def _calc_packet(self, context, output):
        stamp = context.get_time()
        shift = [*BIAS, 0.0, 0.0]
        output.SetFromVector(with_knots(circle_packet(stamp, 1 + round(60 * stamp)), lambda knots: knots + shift))

    def _calc_hand_point(self, context, output):
        stamp = context.get_time()
        p_WT = self._model.tool_pose(self._arm_state.Eval(context)[:6]).translation()
        valid = float(stamp < self._hidden)
        output.SetFromVector(valid * np.array([stamp, 1 + round(60 * stamp), *(p_WT + BIAS), 0.0, 4.0, 1.0]))


@pytest.fixture(scope="module")
def model():
    return make_arm_model(PUMA560)


def run(model, edge, duration, hidden=np.inf):
    """The logs {port: (times, rows)} of a run up to the first descent over a train on a circle."""
    q = joints_for(model, PUMA560.q_start, tool_down(HOME[:3] + [0.0, 0.0, GraspConfig().hover_height], HOME[3]))
    builder = DiagramBuilder()
    grasp = GraspSystem(GraspMachine(GraspConfig(descent="guided", gate="probability"), model, SERVO_PERIOD, HOME[2]))
    guard = PacketGuard(PacketGuardConfig(), VOLUME, TABLE_HEIGHT)
    arm = builder.AddSystem(ArmDiagram(grasp, guard, ServoConfig(), model, q, HOME, TIME_STEP, edge=edge))
    cameras = builder.AddSystem(WrongCameras(model, hidden))
    builder.Connect(arm.GetOutputPort("arm_desired_state"), arm.GetInputPort("arm_state"))
    builder.Connect(arm.GetOutputPort("arm_desired_state"), cameras.GetInputPort("arm_state"))
    for name, message in (("packet", Prediction), ("hand_point", HandPoint)):
        if arm.HasInputPort(name):
            line = DelayLineSystem(message_size(message), LAG, period=VISION_PERIOD, offset=vision_slot(LINK_SLOT))
            builder.AddSystem(line)
            builder.Connect(cameras.GetOutputPort(name), line.get_input_port())
            builder.Connect(line.get_output_port(), arm.GetInputPort(name))
    logs = {
        name: LogVectorOutput(arm.GetOutputPort(name), builder, publish_period=SERVO_PERIOD)
        for name in ("status", "hand_correction", "q_commanded")
        if arm.HasOutputPort(name)
    }
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    arm.GetInputPort("jaws").FixValue(arm.GetMyContextFromRoot(context), [GraspConfig().jaw_opening, 0.0, 0.0])
    Simulator(diagram, context).AdvanceTo(duration)
    found = {name: log.FindLog(context) for name, log in logs.items()}
    return {name: (log.sample_times(), log.data().T) for name, log in found.items()}


def miss(log, since):
    """Where the commanded tool is relative to the true train, mean over the time since then, (x, y) [m]."""
    times, rows = log["status"]
    due = times + 1.5 * SERVO_PERIOD  # about the instant for which the pose is commanded
    angle = 0.15 / 0.12 * due
    true = np.column_stack([0.56 + 0.12 * np.cos(angle), 0.12 * np.sin(angle)])
    late = times >= since
    return (rows[late][:, 3:5] - true[late]).mean(axis=0)


def test_the_hand_is_over_the_object_although_the_cameras_are_wrong(model):
    blind, seeing = (run(model, edge, 2.1) for edge in (None, HandEyeCorrection()))
    assert np.linalg.norm(miss(blind, 1.7) - BIAS[:2]) < 0.004
    assert np.linalg.norm(miss(seeing, 1.7)) < 0.004
    correction = HandCorrection(seeing["hand_correction"][1][-1])
    np.testing.assert_allclose([correction.x, correction.y, correction.z], BIAS, atol=1e-4)
    steps = [np.abs(np.diff(log["q_commanded"][1], axis=0)).max() for log in (blind, seeing)]
    assert steps[1] < 1.3 * steps[0]  # the hand does not jump


def test_the_arm_goes_on_when_its_hand_is_hidden(model):
    log = run(model, HandEyeCorrection(variant(HandEyeConfig, keep=0.2)()), 2.1, hidden=0.5)
    times, rows = log["hand_correction"]
    used = rows[:, HandCorrection.get_fields().index("used")] > 0
    assert used[(times > 0.5) & (times < 0.9)].all() and not used[times > 1.0].any()
    assert np.linalg.norm(miss(log, 1.8) - BIAS[:2]) < 0.004
