"""Tests of the summary of the limits of the arm."""

import numpy as np
import pytest

from drake_tracker.arm.description import PUMA560
from drake_tracker.core.log import Signal
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.tasks.arm_limits import ArmLimits, arm_findings, limits_of

LIMITS = ArmLimits(np.array([-1.0, -2.0]), np.array([1.0, 3.0]), np.array([2.0, 4.0]), np.array([10.0, 20.0]))


def make_log(q, v, u):
    times = TIME_STEP * np.arange(len(q))
    names = ("q1", "q2", "v1", "v2")
    return {
        "arm_state": Signal(times, np.hstack([q, v]), names),
        "arm_effort": Signal(times, np.asarray(u, float), ("u1", "u2")),
    }


def test_findings():
    q, v, u = np.zeros((50, 2)), np.zeros((50, 2)), np.zeros((50, 2))
    q[10] = [0.9, -1.7]
    v[20] = [-1.0, 3.0]
    u[5:12, 0] = -10.0
    u[30:34, 1] = 20.0
    u[36:40, 1] = 20.0
    findings = arm_findings(make_log(q, v, u), LIMITS)
    assert findings["joint_limit_margin_rad"] == pytest.approx(0.1)
    assert findings["speed_share"] == pytest.approx(0.75)
    assert findings["longest_saturation_s"] == pytest.approx(7 * TIME_STEP)


def test_a_joint_past_its_limit_has_a_negative_margin():
    q = np.zeros((3, 2))
    q[1, 1] = 3.05
    assert arm_findings(make_log(q, 0 * q, 0 * q), LIMITS)["joint_limit_margin_rad"] == pytest.approx(-0.05)


def test_a_run_that_logged_nothing():
    empty = np.zeros((0, 2))
    assert set(arm_findings(make_log(empty, empty, empty), LIMITS).values()) == {None}


def test_limits_of_the_puma():
    """Speeds from Corke 1996, table 2.21; torques from Armstrong, Khatib and Burdick 1986, table 7."""
    limits = limits_of(PUMA560)
    np.testing.assert_allclose(limits.speed, [1.92, 1.51, 2.40, 5.34, 5.09, 5.74])
    np.testing.assert_allclose(limits.effort, [97.6, 186.4, 89.4, 24.2, 20.1, 21.3])
    np.testing.assert_allclose(np.rad2deg(limits.lower[:2]), [-160.0, -45.0])
