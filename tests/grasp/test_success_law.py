"""Tests of the law that predicts the share of successful grasps."""

import math
from dataclasses import replace

import numpy as np
import pytest
import success_law
from methods import law_fit
from scipy.special import ndtr

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560, UR5E
from drake_tracker.arm.motion.differential_ik import EFFORT_SHARE, SPEED_SHARE
from drake_tracker.cli import main
from drake_tracker.core.timing import PATH_DURATION
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.success_law import (
    LAW,
    STEP,
    JointShares,
    Situation,
    bends,
    demand,
    followed_share,
    held_share,
    joint_shares,
    limiting,
    predict,
    spread,
    strays,
)
from drake_tracker.tasks.train.setup import resolve

SHARES = JointShares(np.full((16, 1), 1.0 / 0.6), np.full(1, 1.0 / 5.0), np.full(16, 1.0 / 14.0))
"""Of an arm that moves at 0.6 m/s and turns at 5 rad/s with the same joint, and accelerates at 14 m/s^2."""
GUIDED = GraspConfig(descent="guided")
USUAL = Situation(0.15, 0.25, 0.0015, bends(8.0, 0.15), SHARES, GUIDED)


@pytest.mark.parametrize("curvature", [0.0, 8.0, -20.0])
def test_a_path_of_constant_curvature_does_not_stray(curvature):
    for errors in strays(np.full(500, curvature), 0.1, 0.0):
        assert len(errors) == 400 and np.abs(errors) == pytest.approx(np.zeros(400), abs=1e-5)


def test_a_parabola_strays_from_a_circle_as_geometry_says():
    curvature, distance = 8.0, 0.1
    angle = curvature * distance
    across, along, turn = (errors[0] for errors in strays(np.full(500, curvature), distance, 0.0, parabola=True))
    end, circle = 1.0 + 0.5j * angle, (np.exp(1j * angle) - 1.0) / (1j * angle)
    error = distance * (end - circle) * np.exp(-1j * angle)
    assert [along, across] == pytest.approx([error.real, error.imag], abs=3e-5)
    assert turn == pytest.approx(math.atan(angle) - angle, abs=1e-2)


def test_a_straight_that_becomes_an_arc_strays_as_geometry_says():
    """At a place ``before`` the bend the arc is a straight line; the path ends on a circle of radius 1 / curvature."""
    curvature, distance, bend_at = 5.0, 0.12, 0.2
    across, along, turn = strays(np.where(np.arange(400) * STEP < bend_at, 0.0, curvature), distance, 0.0)
    for place in (0.05, 0.10, 0.15, 0.19):
        k, angle = round(place / STEP) - 1, max(place + distance - bend_at, 0.0) * curvature
        end = np.array([bend_at + math.sin(angle) / curvature, (1.0 - math.cos(angle)) / curvature])
        offset = np.array([place + distance, 0.0]) - (end if angle else [place + distance, 0.0])
        left, ahead = np.array([-math.sin(angle), math.cos(angle)]), np.array([math.cos(angle), math.sin(angle)])
        assert across[k] == pytest.approx(offset @ left, abs=3e-5), place
        assert along[k] == pytest.approx(offset @ ahead, abs=3e-5), place
        assert turn[k] == pytest.approx(-angle, abs=1e-2), place


def test_a_memory_takes_the_mean_curvature_for_the_present_one():
    curvature, distance, memory, bend_at = 5.0, 0.1, 0.08, 0.2
    path = np.where(np.arange(500) * STEP < bend_at, 0.0, curvature)
    *_, turn = strays(path, distance, memory)
    for place in (0.22, 0.25, 0.30):
        known = min((place - bend_at) / memory, 1.0) * curvature
        assert turn[round((place - memory) / STEP)] == pytest.approx((known - curvature) * distance, abs=0.01), place


@pytest.mark.parametrize("description", [PUMA560, UR5E])
def test_the_joints_that_a_moving_hand_takes_move_the_hand_so(description):
    model = make_arm_model(description)
    q, still = np.array(description.q_start), np.zeros(model.num_joints)
    shares, jacobian = joint_shares(model, q), model.tool_pose_and_jacobian(q)[1]
    rated, held = SPEED_SHARE * model.velocity_limit, model.drive_torques(q, still, still)
    assert jacobian @ (shares.turn * rated) == pytest.approx([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], abs=1e-9)
    for k, angle in enumerate(np.pi * np.arange(16) / 16):
        rates = shares.speed[k] * rated
        assert jacobian @ rates == pytest.approx([0.0, 0.0, 0.0, math.cos(angle), math.sin(angle), 0.0], abs=1e-9)
        across = (k + 8) % 16  # the direction at a right angle; the opposite one takes the same
        change = np.abs(model.drive_torques(q, still, rates) - held) / (EFFORT_SHARE * (model.effort_limit - abs(held)))
        assert shares.acceleration[across] == pytest.approx(change.max())


def test_without_strays_only_noise_counts():
    assert held_share(np.zeros(3), 0.4) == pytest.approx(2.0 * ndtr(1.0 / 0.4) - 1.0)
    assert held_share(np.array([0.0, 50.0]), 0.01) == pytest.approx(0.5), "half of the places stray too far"


def test_the_place_spreads_with_noise_and_horizon_and_more_for_an_object_that_turns():
    noise, now = 0.01, spread(LAW, 0.01, 0.0, False)
    assert now == pytest.approx(math.hypot(LAW.gain * noise, LAW.hand))
    assert spread(LAW, noise, LAW.growth, False) == pytest.approx(2.0 * now)
    assert spread(LAW, noise, 2.0 * LAW.growth, True) == pytest.approx(5.0 * LAW.oblique * now)


@pytest.mark.parametrize(
    ("field", "values"),
    [("speed", (0.05, 0.1, 0.2, 0.4, 0.8)), ("lag", (0.0, 0.2, 0.5)), ("noise", (0.001, 0.02, 0.1))],
)
def test_what_is_faster_later_or_noisier_fails_more_often(field, values):
    found = [predict(LAW, USUAL._replace(**{field: value}))[0] for value in values]
    assert all(first > second for first, second in zip(found, found[1:])), found


def test_sharper_bends_and_narrower_jaws_fail_more_often_and_a_known_path_less():
    usual, bound = predict(LAW, USUAL)
    assert usual < bound
    assert predict(LAW, USUAL._replace(curvature=bends(30.0, 0.15)))[0] < usual
    assert predict(LAW, USUAL._replace(grasp=replace(GUIDED, jaw_opening=0.06)))[0] < usual
    assert predict(LAW, USUAL._replace(grasp=replace(GUIDED, descent="blind")))[0] < usual
    circle = USUAL._replace(curvature=np.full(5000, 15.0))
    assert predict(LAW, circle._replace(parabola=True))[0] < predict(LAW, circle)[0]
    assert usual < predict(LAW, USUAL._replace(known=True))[0] <= bound
    assert predict(LAW, USUAL._replace(lag=PATH_DURATION))[0] == 0.0, "a packet does not reach that far"


def test_half_of_the_descents_follow_at_the_limit_of_the_arm():
    for speed, bend, turns in ((0.6, 0.0, False), (0.4, 12.5, True), (0.5, 56.0, False)):
        assert demand(speed, bend, turns, SHARES) == pytest.approx(1.0), speed
    assert followed_share(LAW, LAW.limit) == pytest.approx(0.5)


def test_the_largest_gain_comes_first():
    assert next(iter(limiting(LAW, USUAL))) in ("bends", "lag")
    assert next(iter(limiting(LAW, USUAL._replace(noise=0.03, curvature=bends(0.0, 1.0))))) == "noise"
    assert next(iter(limiting(LAW, USUAL._replace(speed=0.8, curvature=bends(0.0, 1.0))))) == "arm"


def test_the_command_names_the_probability_its_interval_and_the_limit(capsys):
    assert main(["predict-success", "--speed", "0.2", "--lag", "0.25", "--curvature", "8", "--arm", "ur5e"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[:20].strip() for line in lines] == ["success", "limited by", "perfect prediction"]
    assert "bends" in lines[1]


@pytest.mark.parametrize("speed", ["0", "2"])
@pytest.mark.parametrize("path", [("0", "0"), ("100", "0"), ("1e-9", "5"), ("100", "5")])
def test_any_path_has_a_probability(capsys, speed, path):
    options = ["--speed", speed, "--lag", "0.9", "--curvature", path[0], "--straight", path[1]]
    assert main(["predict-success", *options]) == 0
    assert "nan" not in capsys.readouterr().out


def test_what_succeeds_is_limited_by_nothing(capsys):
    assert main(["predict-success", "--speed", "0.05", "--curvature", "0"]) == 0
    assert "limited by          nothing" in capsys.readouterr().out


def test_the_benchmark_predicts_what_the_command_predicts(tmp_path):
    condition = {**success_law.drawn(84000), "path": "oval", "estimator": "arc length", "arm": "UR5e", "speed": 0.2}
    scenario = success_law.scenario_of(condition, 84000, tmp_path)
    row = {**condition, **success_law.features(scenario, condition), "launch_s": None}
    setup = resolve(scenario)
    track, _ = setup.placement
    curvature = track.curvature(np.arange(0.5 * STEP, 2.0 * track.length, STEP))
    shares = joint_shares(setup.reach.model, setup.reach.q_initial)
    situation = Situation(0.2, condition["lag"] / 60.0, row["noise_m"], curvature, shares, setup.grasp)
    (found,) = law_fit.predicted(LAW, [row])
    assert found == pytest.approx(predict(LAW, situation)[0], abs=0.02)


def test_settings_and_options_are_the_same(capsys):
    assert main(["predict-success", "--speed", "0.2", "--lag", "0.1"]) == 0
    given = capsys.readouterr().out
    assert main(["predict-success", "--set", "track.speed=0.2", "--set", "vision.lag_cycles=6"]) == 0
    assert capsys.readouterr().out == given


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--speed", "5"], "--speed 5: must be from 0 to 2"),
        (["--noise", "nan"], "--noise nan: must be from 0 to 0.1"),
        (["--arm", "hoist"], "arm must be one of"),
        (["--set", "grasp.jaw_opening=0.03"], "too narrow"),
    ],
)
def test_wrong_options_are_one_line(arguments, said, capsys):
    assert main(["predict-success", *arguments]) == 2
    text = capsys.readouterr().err
    assert said in text and text.count("\n") == 1
