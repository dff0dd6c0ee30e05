"""Faults of the train, the arm and the scene, in the plant itself."""

import math

import numpy as np
import pytest
from faulty_runs import make
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import JawState
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults import config
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_plant, add_table, add_train
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.tracks import make_track
from drake_tracker.world.train.world_diagram import WorldDiagram

REST = 0.45 + TRAIN_HEIGHT
SPEED = 0.15


def ride(settings, duration, period=0.05):
    """Drives a train with a fault; returns {name: column} of time, place, speed along and across the track."""
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, time_step=TIME_STEP)
    add_table(plant, height=0.45)
    train, track = add_train(plant), make_track("oval")
    plant.Finalize()
    add_rail(builder, plant=plant, train=train, ride=Ride(track, speed=SPEED), height=REST, faults=[make(settings)])
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    x, y, heading = track.pose(0.3)
    pose = RigidTransform(RollPitchYaw(0.0, 0.0, heading), [x, y, REST])
    plant.SetFreeBodyPose(context, plant.GetBodyByName("train"), pose)
    rows = []
    for time in np.arange(period, duration + 1e-9, period):
        simulator.AdvanceTo(time)
        state = plant.get_state_output_port(train).Eval(context)
        yaw = 2.0 * math.atan2(state[3], state[0])
        s, lateral = track.nearest(*state[4:6], yaw)
        tangent = track.pose(s)[2]
        along = state[10] * math.cos(tangent) + state[11] * math.sin(tangent)
        tilt = math.hypot(state[1], state[2])
        rows.append([time, *state[4:7], lateral, along, np.linalg.norm(state[10:13]), tilt])
    columns = ("time", "x", "y", "z", "lateral", "along", "speed", "tilt")
    return dict(zip(columns, np.array(rows).T))


def test_a_stopped_train_stands_still_and_goes_on():
    run = ride(config.TrainStopped(at=1.0, duration=1.0), 3.0)
    assert run["speed"][(run["time"] > 1.3) & (run["time"] < 2.0)].max() < 0.002
    assert run["along"][-1] == pytest.approx(SPEED, rel=0.03)
    assert np.abs(run["lateral"]).max() < 0.002


def test_a_train_that_turns_back_stays_on_its_track():
    run = ride(config.TrainReversed(at=1.0), 3.0)
    assert run["along"][-1] == pytest.approx(-SPEED, rel=0.03)
    assert np.abs(run["lateral"]).max() < 0.002


@pytest.mark.parametrize("force, sign", [(2.0, 1.0), (-2.0, -1.0)])
def test_a_pushed_train_returns_to_its_speed(force, sign):
    run = ride(config.TrainPushed(at=1.0, force=force), 3.0)
    pushed = run["along"][np.argmin(np.abs(run["time"] - 1.2))]
    assert sign * (pushed - SPEED) > 0.3
    assert run["along"][-1] == pytest.approx(SPEED, rel=0.05)
    assert np.abs(run["lateral"]).max() < 0.01


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_derailed_train_leaves_its_track_and_stays_on_the_table(side):
    run = ride(config.TrainDerailed(at=1.0, side=side), 2.5)
    off = run["lateral"][-1]
    assert (off if side == "left" else -off) > 0.035
    assert run["z"].min() > REST - 0.005 and run["tilt"].max() < 0.1
    assert run["speed"].max() < 0.6 and run["speed"][-1] < 0.01


@pytest.mark.parametrize(
    "settings", [config.TrainMoved(at=1.0), config.TrainRemoved(at=1.0), config.TrainMoved(at=0.5, to=(0.48, 0.1))]
)
def test_a_carried_train_is_put_down_where_it_should_stand(settings):
    run = ride(settings, settings.at + 4.5)
    carried = (run["time"] > settings.at) & (run["time"] <= settings.at + 3.0)
    assert 0.04 < run["z"][carried].max() - REST < 0.08
    assert run["tilt"][carried].max() < 0.1
    assert run["speed"].max() < 1.2
    assert [run["x"][-1], run["y"][-1]] == pytest.approx(settings.to, abs=0.02)
    assert run["z"][-1] == pytest.approx(REST, abs=0.001) and run["speed"][-1] < 0.02
    step = np.hypot(np.diff(run["x"]), np.diff(run["y"]))
    assert step.max() < 0.06, "nothing is teleported"


Q_INITIAL = joints_for(make_arm_model(PUMA560), PUMA560.q_start, tool_down([0.56, 0.0, 0.70], np.pi))


def hold_still(faults, duration, q=Q_INITIAL, opening=0.088, period=0.05):
    """Runs the laboratory with fixed set-points; returns rows of arm state, jaw state and the bodies of the scene."""
    config = WorldConfig(arm=PUMA560, q_initial=Q_INITIAL, windows={}, faults=[make(each) for each in faults])
    world = WorldDiagram(config, track=make_track("oval"))
    simulator = Simulator(world)
    context = simulator.get_mutable_context()
    world.GetInputPort("arm_desired_state").FixValue(context, np.concatenate([q, np.zeros(6)]))
    world.GetInputPort("arm_feedforward").FixValue(context, np.zeros(6))
    world.GetInputPort("gripper_desired_state").FixValue(context, [0.5 * opening, 0.0])
    rows = []
    for time in np.arange(period, duration + 1e-9, period):
        simulator.AdvanceTo(time)
        arm = world.GetOutputPort("arm_state").Eval(context)
        rows.append((time, arm.copy(), JawState(world.GetOutputPort("jaws").Eval(context)).width))
    return rows, world, context


def test_a_sticking_joint_follows_late_and_never_moves_by_itself():
    q = Q_INITIAL + [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]
    # A step of 0.1 rad, after 0.05 s.
    (free, *_), (stuck, *_) = (hold_still(faults, 0.3, q) for faults in ([], [config.StickingJoint(friction=80.0)]))
    moved = [np.array([arm[0] - Q_INITIAL[0] for _, arm, _ in rows]) for rows in (free, stuck)]
    assert moved[0][0] > 1.2 * moved[1][0] > 0.0
    still, *_ = hold_still([config.StickingJoint(joint=joint, friction=200.0) for joint in range(1, 7)], 0.3)
    assert max(np.abs(arm[6:]).max() for _, arm, _ in still) < 0.2


def test_a_slow_gripper_closes_slowly_while_the_fault_lasts():
    rows, *_ = hold_still([config.SlowGripper(speed=0.04, at=0.0, duration=0.6)], 1.0, opening=0.03)
    widths = {round(time, 2): width for time, _, width in rows}
    assert (widths[0.1] - widths[0.5]) / 0.4 == pytest.approx(0.04, rel=0.1)
    assert widths[0.5] > 0.06 and widths[1.0] == pytest.approx(0.03, abs=0.001)


def test_a_panel_and_a_second_mover_go_where_they_should():
    _, world, context = hold_still([config.PassingOccluder(at=0.1), config.SecondMover(at=0.0)], 1.0)
    plant = world.laboratory.plant
    inner = plant.GetMyContextFromRoot(context)
    panel = plant.GetBodyByName("occluder_0").EvalPoseInWorld(inner).translation()
    assert panel == pytest.approx([0.56 + 0.55 * 0.930, 0.55 * 0.930, 0.47 + 0.55 * 0.479], abs=0.03)
    (fault,) = [make(config.SecondMover(at=0.0))]
    mover = plant.GetBodyByName("second_mover_0").EvalPoseInWorld(inner).translation()
    assert mover == pytest.approx([0.56, fault.slide(1.0)[0], 0.476], abs=0.005)
