import copy

import numpy as np
import pytest
from ball_scenario import make_scenario
from pydrake.common.value import AbstractValue
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactResults
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560_CUP
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import CatchVerdict
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.ball.ball_board import BALL_RADIUS
from drake_tracker.world.ball.ball_plant import add_ball_laboratory
from drake_tracker.world.ball.catch_judge_system import BOWL_LOWER, BOWL_UPPER, HELD, JAMMED, CatchJudgeSystem

HAND_IN_COLUMN = np.array([0.0, -0.1, -3.9, 0.0, -1.5, np.pi])
"""Joints [rad] at which the arm has folded so far that its cup is in its own column."""
TOOL = np.array([0.48, 0.0, 0.47])
IN_CUP = np.array([0.0, 0.01, BOWL_UPPER[2] - BALL_RADIUS + 0.0005])
"""The ball on the bottom of the bowl, in T [m]."""


class Touch:
    """Contacts and poses in the laboratory when ball and hand are put to a place, one plant step later."""

    def __init__(self):
        builder = DiagramBuilder()
        self.laboratory = add_ball_laboratory(
            builder, description=PUMA560_CUP, board=make_scenario().board, ball=make_scenario().ball
        )
        self._diagram = builder.Build()
        self._model = make_arm_model(PUMA560_CUP)
        self.X_WB = self.laboratory.X_WB

    def at(self, p_WBall, p_WT=TOOL):
        """Returns (ContactResults, poses of all bodies, p_WBall)."""
        return self.with_joints(p_WBall, joints_for(self._model, PUMA560_CUP.q_start, tool_down(p_WT, np.pi)))

    def with_joints(self, p_WBall, q):
        """The same with given joints."""
        plant = self.laboratory.plant
        simulator = Simulator(self._diagram)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetPositions(context, self.laboratory.arm, q)
        plant.get_desired_state_input_port(self.laboratory.arm).FixValue(context, np.append(q, np.zeros(6)))
        plant.get_desired_state_input_port(self.laboratory.gate).FixValue(context, np.zeros(2))
        plant.SetFreeBodyPose(context, self.laboratory.ball_body, RigidTransform(p_WBall))
        poses = list(plant.get_body_poses_output_port().Eval(context))
        simulator.AdvanceTo(1.5 * plant.time_step())
        contacts = copy.copy(plant.get_contact_results_output_port().Eval(context))
        return contacts, poses, np.asarray(p_WBall)

    def in_tool(self, p_TBall):
        return tool_down(TOOL, np.pi) @ np.asarray(p_TBall)

    def on_board(self, x, y, z=BALL_RADIUS - 0.0005):
        return self.X_WB @ np.array([x, y, z])


@pytest.fixture(scope="module")
def touch():
    return Touch()


@pytest.fixture(scope="module")
def scenes(touch):
    """{what it shows: (contacts, poses, p_WBall)}."""
    return {
        "start": touch.at(touch.X_WB @ touch.laboratory.p_BoBall),
        "rolling": touch.at(touch.on_board(0.05, 0.15)),
        "in the air": touch.at(touch.on_board(0.05, -0.02)),
        "in the cup": touch.at(touch.in_tool(IN_CUP)),
        "over the cup": touch.at(touch.in_tool(IN_CUP - [0.0, 0.0, 0.01])),
        "on the back wall": touch.at(touch.in_tool([0.0425, 0.0, -0.030 - BALL_RADIUS + 0.0005])),
        "under the cup": touch.at(touch.in_tool([-0.03, 0.03, 0.075 + BALL_RADIUS - 0.0005])),
        "floor": touch.at([0.5, 0.6, BALL_RADIUS - 0.0005]),
        "table": touch.at([1.0, 0.45, 0.45 + BALL_RADIUS - 0.0005]),
        "arm on board": touch.at(touch.on_board(0.2, 0.5), touch.X_WB @ np.array([0.0, 0.30, 0.091])),
    }


class Puppets(LeafSystem):
    """Shows the judge whatever ``script(time)`` says: (a scene, the ball's speed [m/s])."""

    def __init__(self, script):
        super().__init__()
        self._script = script
        self.DeclareAbstractOutputPort("contacts", lambda: AbstractValue.Make(ContactResults()), self._contacts)
        self.DeclareAbstractOutputPort("poses", lambda: AbstractValue.Make([RigidTransform()]), self._poses)
        self.DeclareVectorOutputPort("ball", 13, self._ball)

    def _contacts(self, context, output):
        output.set_value(self._script(context.get_time())[0][0])

    def _poses(self, context, output):
        output.set_value(self._script(context.get_time())[0][1])

    def _ball(self, context, output):
        (_, _, p_WBall), speed = self._script(context.get_time())
        output.SetFromVector([1.0, 0.0, 0.0, 0.0, *p_WBall, 0.0, 0.0, 0.0, speed, 0.0, 0.0])


class Trial:
    """A judge that watches puppets; `at` returns its CatchVerdict at a time [s]."""

    def __init__(self, touch, script):
        builder = DiagramBuilder()
        puppets = builder.AddSystem(Puppets(script))
        self._judge = builder.AddSystem(CatchJudgeSystem(laboratory=touch.laboratory))
        builder.Connect(puppets.GetOutputPort("contacts"), self._judge.GetInputPort("contact_results"))
        builder.Connect(puppets.GetOutputPort("poses"), self._judge.GetInputPort("body_poses"))
        builder.Connect(puppets.GetOutputPort("ball"), self._judge.GetInputPort("ball_state"))
        self._simulator = Simulator(builder.Build())

    def at(self, time):
        self._simulator.AdvanceTo(time)
        context = self._judge.GetMyContextFromRoot(self._simulator.get_context())
        return CatchVerdict(self._judge.GetOutputPort("verdict").Eval(context).copy())


def test_it_tells_when_the_arm_touches_itself(touch, scenes):
    folded = touch.with_joints(touch.on_board(0.05, 0.15), HAND_IN_COLUMN)
    assert judged(touch, folded).self_touched == 1.0
    assert judged(touch, scenes["arm on board"]).self_touched == 0.0


def judged(touch, scene, time=0.01, speed=0.5):
    return Trial(touch, lambda t: (scene, speed)).at(time)


@pytest.mark.parametrize(
    "scene, in_cup, lost, board_touched",
    [
        ("start", 0, 0, 0),
        ("rolling", 0, 0, 0),
        ("in the air", 0, 0, 0),
        ("in the cup", 1, 0, 0),
        ("over the cup", 0, 0, 0),
        ("on the back wall", 0, 0, 0),
        ("under the cup", 0, 0, 0),
        ("floor", 0, 1, 0),
        ("table", 0, 1, 0),
        ("arm on board", 0, 0, 1),
    ],
)
def test_it_tells_where_the_ball_is_and_what_touches(touch, scenes, scene, in_cup, lost, board_touched):
    verdict = judged(touch, scenes[scene])
    assert (verdict.in_cup, verdict.lost, verdict.board_touched) == (in_cup, lost, board_touched)
    assert verdict.height == pytest.approx(scenes[scene][2][2])
    p_BBall = touch.X_WB.inverse() @ scenes[scene][2]
    np.testing.assert_allclose([verdict.x, verdict.y], p_BBall[:2], atol=1e-12)


def test_caught_is_in_the_cup_for_a_second(touch, scenes):
    start = 0.5
    trial = Trial(touch, lambda t: (scenes["in the cup" if t > start else "in the air"], 0.0))
    assert trial.at(start).held == 0.0
    assert trial.at(start + HELD - 0.02).caught == 0.0
    verdict = trial.at(start + HELD + 2.5 * VISION_PERIOD)
    assert verdict.caught == 1.0
    assert verdict.held == pytest.approx(HELD, abs=3 * VISION_PERIOD)
    assert start <= verdict.held_since <= start + 2 * VISION_PERIOD


@pytest.mark.parametrize("slip", ["over the cup", "on the back wall"])
def test_a_hop_starts_the_second_anew(touch, scenes, slip):
    trial = Trial(touch, lambda t: (scenes[slip if 0.80 < t < 0.84 else "in the cup"], 0.0))
    assert trial.at(1.7).caught == 0.0
    assert trial.at(1.95).caught == 1.0


@pytest.mark.parametrize("scene", ["over the cup", "on the back wall", "under the cup", "rolling"])
def test_close_is_not_caught(touch, scenes, scene):
    assert judged(touch, scenes[scene], time=2.0).caught == 0.0


def test_what_was_caught_stays_caught_and_what_was_lost_lost(touch, scenes):
    trial = Trial(touch, lambda t: (scenes["in the cup" if t < 1.2 else "floor" if t < 1.5 else "rolling"], 0.3))
    assert trial.at(1.1).caught == 1.0
    verdict = trial.at(2.0)
    assert (verdict.caught, verdict.held, verdict.lost) == (1.0, 0.0, 1.0)


def test_a_ball_against_the_board_is_not_held(touch, scenes):
    contacts = touch.at(touch.on_board(0.0, 0.3))[0]
    scene = (contacts, *scenes["in the cup"][1:])
    assert judged(touch, scene, time=1.5).caught == 0.0


def moving(touch, scenes, p_BBall, contacts="rolling"):
    return (*scenes[contacts][:2], touch.X_WB @ np.asarray(p_BBall))


def test_release_crossing_and_leaving(touch, scenes):
    start = touch.laboratory.p_BoBall

    def script(t):
        if t < 0.2:
            return scenes["start"], 0.0
        y = start[1] - 1.2 * (t - 0.2)
        contacts = "rolling" if y > -0.03 else "in the air"
        return moving(touch, scenes, [0.1 + 0.2 * t, y, BALL_RADIUS], contacts), 1.2

    trial = Trial(touch, script)
    verdict = trial.at(0.2)
    assert (verdict.released, verdict.crossing_time, verdict.left_board) == (0, 0, 0)
    assert trial.at(0.3).released == pytest.approx(0.2, abs=1.5 * VISION_PERIOD)
    crossing = 0.2 + start[1] / 1.2
    assert trial.at(crossing - 0.02).crossing_time == 0.0
    verdict = trial.at(1.5)
    assert verdict.crossing_time == pytest.approx(crossing, abs=1e-6)
    assert verdict.crossing_x == pytest.approx(0.1 + 0.2 * crossing, abs=1e-6)
    assert verdict.left_board == pytest.approx(crossing + 0.03 / 1.2, abs=1.5 * VISION_PERIOD)


def test_a_jam_is_lost_and_a_ball_behind_the_gate_is_not(touch, scenes):
    assert judged(touch, scenes["start"], time=JAMMED + 1.0, speed=0.0).lost == 0.0
    trial = Trial(touch, lambda t: (scenes["start" if t < 0.5 else "rolling"], 0.0))
    assert trial.at(0.5 + JAMMED - 0.1).lost == 0.0
    verdict = trial.at(0.5 + JAMMED + 0.1)
    assert verdict.lost == 1.0
    assert verdict.rest_since == pytest.approx(0.5, abs=2 * VISION_PERIOD)
    assert judged(touch, scenes["rolling"], time=JAMMED + 1.0, speed=0.1).lost == 0.0


def test_the_bowl_is_the_one_of_the_model(touch):
    """`BOWL_LOWER` and `BOWL_UPPER` end where the walls begin."""
    laboratory = touch.laboratory
    inspector = laboratory.scene_graph.model_inspector()
    hand = laboratory.plant.GetBodyByName("hand", laboratory.gripper)
    X_HT = laboratory.plant.GetFrameByName("tool", laboratory.gripper).GetFixedPoseInBodyFrame()
    spans = {}
    for geometry in laboratory.plant.GetCollisionGeometriesForBody(hand):
        shape = inspector.GetShape(geometry)
        if isinstance(shape, Box):
            middle = (X_HT.inverse() @ inspector.GetPoseInFrame(geometry)).translation()
            name = inspector.GetName(geometry).split("::")[-1]
            spans[name] = (middle - 0.5 * shape.size(), middle + 0.5 * shape.size())
    np.testing.assert_allclose(
        [spans["front"][1][0], spans["right"][1][1], spans["front"][0][2]], BOWL_LOWER, atol=1e-12
    )
    np.testing.assert_allclose(
        [spans["back"][0][0], spans["left"][0][1], spans["bottom"][0][2]], BOWL_UPPER, atol=1e-12
    )
    assert spans["back"][0][2] == pytest.approx(-0.030)
