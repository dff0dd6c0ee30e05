"""The judge, on contacts between real models, and on one real grasp."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import ContactResults
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import JawState, Verdict
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.world.base_world_diagram import add_jaw_sensor
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.grasp_judge_system import HELD, LIFTED, OFF_TRACK, GraspJudgeSystem, add_grasp_judge
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_laboratory
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.tracks import make_track

TABLE_HEIGHT = 0.45
REST = TABLE_HEIGHT + TRAIN_HEIGHT
TRACK = make_track("oval")

HAND_IN_COLUMN = np.array([0.0, -0.1, -3.9, 0.0, -1.5, 0.0])
"""Joints [rad] at which the arm has folded so far that its hand is in its own column."""


@pytest.fixture(scope="module")
def model():
    return make_arm_model(PUMA560)


class Touch:
    """Contacts in the laboratory when train, hand and jaws are put to a place, one plant step later."""

    def __init__(self, model):
        builder = DiagramBuilder()
        self.laboratory = add_laboratory(builder, description=PUMA560, table_height=TABLE_HEIGHT)
        self._diagram = builder.Build()
        self._model = model

    def at(self, p_WO, p_WT, half_opening=0.044):
        return self.with_joints(p_WO, joints_for(self._model, PUMA560.q_start, tool_down(p_WT, np.pi)), half_opening)

    def with_joints(self, p_WO, q, half_opening=0.044):
        plant = self.laboratory.plant
        simulator = Simulator(self._diagram)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetPositions(context, self.laboratory.arm, q)
        plant.SetPositions(context, self.laboratory.gripper, [half_opening, half_opening])
        plant.SetFreeBodyPose(context, self.laboratory.train_body, RigidTransform(p_WO))
        simulator.AdvanceTo(1.5 * TIME_STEP)
        return copy.copy(plant.get_contact_results_output_port().Eval(context))


@pytest.fixture(scope="module")
def touch(model):
    return Touch(model)


@pytest.fixture(scope="module")
def contacts(touch):
    """{what touches what: ContactResults}."""
    high = np.array([0.56, 0.0, 0.70])
    aside = np.array([0.0, 0.0025, 0.0])
    return {
        "nothing": touch.at([0.56, 0.3, 0.9], high),
        "wheels": touch.at([0.56, 0.1, REST - 0.0005], high),
        "both": touch.at(high, high, 0.0195),
        # The hand is turned by 180 deg: its left finger is the one on the side of +y of the world or of -y.
        "one": touch.at(high + aside, high, 0.0215),
        "other": touch.at(high - aside, high, 0.0215),
        "itself": touch.with_joints([0.56, 0.1, REST], HAND_IN_COLUMN),
        "table": touch.at([0.56, 0.3, REST], [0.56, 0.0, TABLE_HEIGHT + 0.010]),
    }


class Puppets(LeafSystem):
    """Shows the judge whatever ``script(time)`` says.

    The script returns ContactResults, the train's pose, the scale of its quaternion, and its speed [m/s].
    """

    def __init__(self, script):
        super().__init__()
        self._script = script
        self.DeclareAbstractOutputPort("contacts", lambda: AbstractValue.Make(ContactResults()), self._calc_contacts)
        self.DeclareVectorOutputPort("train", 13, self._calc_train)

    def _calc_contacts(self, context, output):
        output.set_value(self._script(context.get_time())[0])

    def _calc_train(self, context, output):
        said = self._script(context.get_time())
        _, X_WO, scale, speed = (*said, *(1.0, 0.0)[len(said) - 2 :])
        quaternion = X_WO.rotation().ToQuaternion().wxyz() * scale
        output.SetFromVector(np.concatenate([quaternion, X_WO.translation(), [0.0, 0.0, 0.0, speed, 0.0, 0.0]]))


class Trial:
    """A judge that watches puppets; `at` returns its Verdict at a time [s]."""

    def __init__(self, touch, script):
        builder = DiagramBuilder()
        puppets = builder.AddSystem(Puppets(script))
        self._judge = builder.AddSystem(GraspJudgeSystem(laboratory=touch.laboratory, track=TRACK, rest_height=REST))
        builder.Connect(puppets.GetOutputPort("contacts"), self._judge.GetInputPort("contact_results"))
        builder.Connect(puppets.GetOutputPort("train"), self._judge.GetInputPort("train_state"))
        self._simulator = Simulator(builder.Build())

    def at(self, time):
        self._simulator.AdvanceTo(time)
        context = self._judge.GetMyContextFromRoot(self._simulator.get_context())
        return Verdict(self._judge.GetOutputPort("verdict").Eval(context).copy())


def on_track(lift=0.0, s=0.0, aside=0.0, roll=0.0):
    x, y, heading = TRACK.pose(s)
    R_WO = RotationMatrix.MakeZRotation(heading) @ RotationMatrix.MakeXRotation(roll)
    return RigidTransform(R_WO, [x - aside * np.sin(heading), y + aside * np.cos(heading), REST + lift])


def test_it_tells_who_touches_what(touch, contacts):
    def judged(name):
        verdict = Trial(touch, lambda t: (contacts[name], on_track())).at(0.01)
        return verdict.left_contact, verdict.right_contact, verdict.table_touched, verdict.self_touched

    assert judged("nothing") == (0, 0, 0, 0)
    assert judged("wheels") == (0, 0, 0, 0), "a train on its wheels is no hand on the table"
    assert judged("both") == (1, 1, 0, 0)
    assert sorted([judged("one")[:2], judged("other")[:2]]) == [(0, 1), (1, 0)]
    assert judged("table") == (0, 0, 1, 0)
    assert judged("itself")[3] == 1


def test_taken_is_lifted_by_both_fingers_for_a_second(touch, contacts):
    start = 0.5

    def script(t):
        return contacts["both"], on_track(lift=LIFTED + 0.001 if t > start else 0.02)

    trial = Trial(touch, script)
    assert trial.at(start).held == 0.0
    assert trial.at(start + HELD - 0.02).taken == 0.0
    verdict = trial.at(start + HELD + 2.5 * VISION_PERIOD)
    assert verdict.taken == 1.0
    assert verdict.held == pytest.approx(HELD, abs=3 * VISION_PERIOD)
    assert verdict.lift == pytest.approx(LIFTED + 0.001)
    assert start <= verdict.held_since <= start + 2 * VISION_PERIOD


def test_of_several_trains_the_one_in_the_hand_is_judged(touch, contacts):
    # The train of the contacts is the second one here; the first one stands for ever.
    body = touch.laboratory.plant.GetBodyByName("table")
    builder = DiagramBuilder()
    first = builder.AddSystem(Puppets(lambda t: (contacts["both" if t > 0.3 else "nothing"], on_track())))
    second = builder.AddSystem(Puppets(lambda t: (contacts["nothing"], on_track(lift=LIFTED + 0.02))))
    judge = builder.AddSystem(
        GraspJudgeSystem(
            laboratory=replace(touch.laboratory, train_body=body),
            track=TRACK,
            rest_height=REST,
            others=[(touch.laboratory.train_body, TRACK)],
        )
    )
    builder.Connect(first.GetOutputPort("contacts"), judge.GetInputPort("contact_results"))
    builder.Connect(first.GetOutputPort("train"), judge.GetInputPort("train_state"))
    builder.Connect(second.GetOutputPort("train"), judge.GetInputPort("train_state_1"))
    simulator = Simulator(builder.Build())
    context = judge.GetMyContextFromRoot(simulator.get_context())

    def findings(time):
        simulator.AdvanceTo(time)
        verdict = Verdict(judge.GetOutputPort("verdict").Eval(context).copy())
        return judge.GetOutputPort("judged").Eval(context)[0], verdict.lift, verdict.taken

    assert findings(0.2) == (0.0, pytest.approx(0.0), 0.0)
    assert findings(1.0) == (1.0, pytest.approx(LIFTED + 0.02), 0.0)
    assert findings(1.5) == (1.0, pytest.approx(LIFTED + 0.02), 1.0)


def test_the_period_can_be_chosen(touch):
    judge = GraspJudgeSystem(laboratory=touch.laboratory, track=TRACK, rest_height=REST, period=0.1)
    assert judge.GetUniquePeriodicDiscreteUpdateAttribute().period_sec() == 0.1


@pytest.mark.parametrize(
    "contact, lift",
    [("nothing", 0.20), ("one", 0.20), ("other", 0.20), ("both", LIFTED - 0.001), ("both", 0.0)],
    ids=["floating at the hand", "one finger", "other finger", "too low", "on the rail"],
)
def test_less_than_that_is_not_taken(touch, contacts, contact, lift):
    verdict = Trial(touch, lambda t: (contacts[contact], on_track(lift=lift))).at(2.0)
    assert verdict.taken == 0.0 and verdict.held == 0.0


@pytest.mark.parametrize("slip", ["contact", "height"])
def test_a_slip_starts_the_second_anew(touch, contacts, slip):
    def script(t):
        slipping = 0.80 < t < 0.84
        contact = "one" if slipping and slip == "contact" else "both"
        return contacts[contact], on_track(lift=0.05 if slipping and slip == "height" else 0.15)

    trial = Trial(touch, script)
    assert trial.at(1.7).taken == 0.0
    assert trial.at(1.95).taken == 1.0


def test_what_was_taken_stays_taken(touch, contacts):
    def script(t):
        return (contacts["both"], on_track(lift=0.15)) if t < 1.2 else (contacts["nothing"], on_track())

    trial = Trial(touch, script)
    assert trial.at(1.1).taken == 1.0
    verdict = trial.at(1.6)
    assert verdict.taken == 1.0 and verdict.held == 0.0


def test_a_touched_table_stays_touched(touch, contacts):
    trial = Trial(touch, lambda t: (contacts["table" if t < 0.1 else "nothing"], on_track()))
    assert trial.at(0.05).table_touched == 1.0
    assert trial.at(0.5).table_touched == 1.0


@pytest.mark.parametrize(
    "pose, derailed",
    [
        ({}, False),
        ({"aside": OFF_TRACK - 0.003}, False),
        ({"aside": OFF_TRACK + 0.003}, True),
        ({"aside": -OFF_TRACK - 0.003}, True),
        ({"roll": np.deg2rad(55)}, False),
        ({"roll": np.deg2rad(65)}, True),
        ({"roll": np.pi}, True),
        ({"lift": 0.15}, False),
    ],
    ids=str,
)
@pytest.mark.parametrize("scale", [1.0, 1.2])
def test_derailed_is_lying_where_it_does_not_come_back(touch, contacts, pose, derailed, scale):
    # The plant lets the quaternion's norm drift; the verdict must not.
    verdict = Trial(touch, lambda t: (contacts["wheels"], on_track(s=0.4, **pose), scale)).at(0.05)
    assert bool(verdict.derailed) is derailed


def test_a_train_that_is_carried_is_not_derailed_and_one_that_fell_is(touch, contacts):
    """A run ended while an invisible hand carried the train to another place."""

    def script(t):
        return contacts["nothing"], on_track(aside=0.06, lift=0.1 if t < 0.2 else -0.06), 1.0, 0.1

    trial = Trial(touch, script)
    assert not trial.at(0.1).derailed
    assert trial.at(0.3).derailed


def test_a_train_in_the_hand_is_not_derailed_and_one_put_back_no_longer(touch, contacts):
    def script(t):
        return contacts["one" if t < 0.2 else "nothing"], on_track(aside=0.06 if t < 0.4 else 0.0)

    trial = Trial(touch, script)
    assert trial.at(0.1).derailed == 0.0
    assert trial.at(0.3).derailed == 1.0
    assert trial.at(0.5).derailed == 0.0


class Grasp:
    """The arm, told where the standing train is, comes down on it, closes its jaws and lifts it."""

    above, down, closed, up, end = 0.15, 0.5, 0.8, 1.4, 2.8

    def __init__(self, model, aside=0.0):
        s = 0.4
        x, y, heading = TRACK.pose(s)
        builder = DiagramBuilder()
        self.laboratory = laboratory = add_laboratory(builder, description=PUMA560, table_height=TABLE_HEIGHT)
        plant = laboratory.plant
        add_rail(builder, plant=plant, train=laboratory.train, ride=Ride(TRACK, speed=0.0), height=REST)
        p_x, p_y = x - aside * np.sin(heading), y + aside * np.cos(heading)
        high, low = (
            joints_for(model, PUMA560.q_start, tool_down([p_x, p_y, z], heading)) for z in (REST + self.above, REST)
        )
        motion = PiecewisePolynomial.CubicShapePreserving(
            [0.0, self.down, self.closed, self.up, self.end], np.column_stack([high, low, low, high, high]), True
        )
        jaws = PiecewisePolynomial.FirstOrderHold([0.0, self.down, self.closed, self.end], [[0.044, 0.044, 0.0, 0.0]])
        arm_set_points = builder.AddSystem(TrajectorySource(motion, 1))
        jaw_set_points = builder.AddSystem(TrajectorySource(jaws, 1))
        gravity = builder.AddSystem(
            InverseDynamics(model.plant, InverseDynamics.InverseDynamicsMode.kGravityCompensation)
        )
        builder.Connect(plant.get_state_output_port(laboratory.arm), gravity.get_input_port_estimated_state())
        builder.Connect(gravity.get_output_port_generalized_force(), plant.get_actuation_input_port(laboratory.arm))
        builder.Connect(arm_set_points.get_output_port(), plant.get_desired_state_input_port(laboratory.arm))
        builder.Connect(jaw_set_points.get_output_port(), plant.get_desired_state_input_port(laboratory.gripper))
        self.judge = add_grasp_judge(builder, laboratory=laboratory, track=TRACK, rest_height=REST)
        self.sensor = add_jaw_sensor(builder, plant=plant, gripper=laboratory.gripper)
        self.simulator = Simulator(builder.Build())
        context = plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        plant.SetPositions(context, laboratory.arm, high)
        plant.SetPositions(context, laboratory.gripper, [0.044, 0.044])
        X_WO = RigidTransform(RotationMatrix.MakeZRotation(heading), [x, y, REST])
        plant.SetFreeBodyPose(context, laboratory.train_body, X_WO)

    def at(self, time):
        self.simulator.AdvanceTo(time)
        root = self.simulator.get_context()
        jaws = self.sensor.GetOutputPort("jaws").Eval(self.sensor.GetMyContextFromRoot(root))
        verdict = self.judge.GetOutputPort("verdict").Eval(self.judge.GetMyContextFromRoot(root))
        return Verdict(verdict.copy()), JawState(jaws.copy())


def test_a_real_grasp_is_taken(model):
    grasp = Grasp(model)
    verdict, jaws = grasp.at(grasp.down)
    assert (verdict.left_contact, verdict.right_contact, verdict.lift) == (0, 0, pytest.approx(0.0, abs=1e-3))
    assert jaws.width == pytest.approx(0.088, abs=2e-3)
    verdict, jaws = grasp.at(grasp.closed + 0.1)
    assert (verdict.left_contact, verdict.right_contact) == (1, 1)
    assert jaws.width == pytest.approx(0.040, abs=1e-3)
    assert 15.0 < jaws.force <= 25.0
    verdict, _ = grasp.at(grasp.up + 0.3)
    assert verdict.taken == 0.0, "it was not held for long enough"
    verdict, jaws = grasp.at(grasp.end)
    assert verdict.taken == 1.0 and verdict.table_touched == 0.0 and verdict.derailed == 0.0
    assert verdict.lift == pytest.approx(grasp.above, abs=0.01)
    assert jaws.force > 15.0


def test_jaws_that_close_beside_the_train_take_nothing(model):
    grasp = Grasp(model, aside=0.14)
    verdict, jaws = grasp.at(grasp.end)
    assert verdict.taken == 0.0 and verdict.lift == pytest.approx(0.0, abs=1e-3)
    assert jaws.width < 0.01
