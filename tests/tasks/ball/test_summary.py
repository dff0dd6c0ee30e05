"""Tests of the summary of a run of the ball, on a synthetic run."""

import numpy as np
import pytest
from ball_log import EXIT_SPEED, ROLL, BallRun, nothing_logged

from drake_tracker.core.messages import CatchVerdict
from drake_tracker.tasks.ball.setup import resolve
from drake_tracker.tasks.ball.summary import failure_reason, summarise_ball


@pytest.fixture
def run():
    return BallRun()


def summarize(run, **changes):
    return summarise_ball(run.hand_eye, resolve(run.scenario, run.hand_eye.poses), run.log(), run.duration, **changes)


def verdict(**fields):
    found = CatchVerdict(np.zeros(len(CatchVerdict.get_fields())))
    for name, value in fields.items():
        setattr(found, name, value)
    return found


def test_a_ball_that_is_caught(run):
    run.hand = -0.012
    summary = summarize(run)
    assert summary["success"] is True and summary["failure_reason"] is None
    assert (summary["scenario"], summary["seed"], summary["interrupted"]) == ("rolling", 4, False)
    assert summary["hand_error_m"] == pytest.approx(-0.012, abs=1e-6)
    assert summary["roll_s"] == pytest.approx(ROLL, abs=1e-6)
    assert summary["hold_s"] == pytest.approx(run.duration - run.crossing - 0.1, abs=1e-6)
    assert summary["board_in_camera_error"] == summary["board_in_world_error"] == [0.0, 0.0]


def test_the_offset_of_the_points_is_the_rms_error(run):
    run.point_offset = 0.003
    summary = summarize(run)
    assert summary["position_rms_m"] == pytest.approx(0.003, abs=1e-4)
    assert 0.8 < summary["vision_valid_fraction"] <= 1.0


def test_the_predicted_crossing_is_judged_at_three_times(run):
    run.crossing_offset = 0.021
    assert summarize(run)["crossing_error_m"] == pytest.approx({"0.4": 0.021, "0.25": 0.021, "0.1": 0.021}, abs=1e-6)


def test_a_ball_that_leaves_at_an_angle_is_judged_where_it_passes_over_the_cup(run):
    run.crossing_offset, run.hand = 0.021, -0.012
    log = run.log()
    truth, R_WB = log["truth_ball_state"], run.X_WB.rotation().matrix()
    velocity = R_WB @ [0.3, -1.0, 0.0]
    truth.data[:, [truth.names.index(name) for name in ("vx", "vy", "vz")]] = velocity
    summary = summarise_ball(run.hand_eye, resolve(run.scenario, run.hand_eye.poses), log, run.duration)
    aside = 0.3 / np.hypot(*R_WB[:2, 1]) * run.scenario.catch.beyond
    assert summary["hand_error_m"] == pytest.approx(-0.012 - aside, abs=1e-6)
    assert summary["crossing_error_m"]["0.25"] == pytest.approx(0.021, abs=1e-6)  # on the edge


def test_pose_errors_of_the_initialisation(run):
    X_WB = run.hand_eye.poses.X_WB
    X_WB.set_translation(X_WB.translation() + [0.0, 0.0006, 0.0008])
    place, turn = summarize(run)["board_in_world_error"]
    assert place == pytest.approx(0.001) and turn == 0.0


def test_a_ball_that_is_never_released(run):
    run.released = None
    summary = summarize(run)
    assert summary["success"] is False and "never released" in summary["failure_reason"]
    for key in ("hand_error_m", "roll_s", "exit_speed_m_s", "position_rms_m", "vision_valid_fraction", "lag_s"):
        assert summary[key] is None, key
    assert summary["crossing_error_m"] == {}


def test_a_run_that_logged_nothing(run):
    summary = summarise_ball(
        run.hand_eye, resolve(run.scenario, run.hand_eye.poses), nothing_logged(), 0.0, interrupted=True
    )
    assert summary["success"] is False and summary["failure_reason"].startswith("interrupted")


def test_exit_speed_is_the_speed_at_the_edge(run):
    log = run.log()
    truth = log["truth_ball_state"]
    truth.data[:, truth.names.index("vx")] = -EXIT_SPEED
    summary = summarise_ball(run.hand_eye, resolve(run.scenario, run.hand_eye.poses), log, run.duration)
    assert summary["exit_speed_m_s"] == pytest.approx(EXIT_SPEED)


@pytest.mark.parametrize(
    "fields, hand_error, words",
    [
        (dict(), None, "the ball was never released"),
        (
            dict(released=1.0, rest_since=3.0, x=0.123, y=0.456),
            None,
            "jammed at a peg and came to rest on the board at x 0.12, y 0.46 m",
        ),
        (dict(released=1.0, lost=1.0, y=0.3), None, "rolled off a side of the board"),
        (dict(released=1.0, y=0.3), None, "still on the board when the run ended"),
        (
            dict(released=1.0, crossing_time=2.5, in_cup=1.0, held=0.42),
            0.004,
            "in the cup for only 0.42 s when the run ended",
        ),
        (
            dict(released=1.0, crossing_time=2.5, lost=1.0),
            -0.081,
            "the cup was 81 mm from the ball; at most 30 mm is possible",
        ),
        (
            dict(released=1.0, crossing_time=2.5, lost=1.0),
            0.011,
            "passed 11 mm from the middle of the cup and did not stay",
        ),
    ],
)
def test_every_failure_has_a_sentence(fields, hand_error, words):
    assert words in failure_reason(verdict(**fields), hand_error, False)
    assert failure_reason(verdict(**fields), hand_error, True).startswith("interrupted; until then the ")


def test_the_same_log_gives_the_same_summary(run):
    assert summarize(run) == summarize(run)
    assert np.isfinite(summarize(run)["joint_limit_margin_rad"])
