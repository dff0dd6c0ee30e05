"""The summary of a run of the ball: its outcome and the errors of each part, measured against ground truth."""

from typing import Any

import numpy as np

from drake_tracker.cameras.boards.board_poses import pose_error
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import CatchVerdict
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.ball.setup import BallSetup
from drake_tracker.tasks.episode import Log
from drake_tracker.tasks.results import lag_of, last_message, limiter_findings, made_by, packet_findings, tidy
from drake_tracker.world.ball.ball_camera import NAME

ROLLING = 0.10
"""Time after the release at which vision sees the ball move [s]."""
BEFORE_CROSSING = (0.4, 0.25, 0.1)
"""Times before the ball leaves the board at which the predicted crossing is judged [s]."""
HALF_CUP = 0.030
"""Greatest distance across, from the middle of the cup, at which the ball falls in without touching the rim [m]."""


def summarise_ball(
    hand_eye: HandEyeDiagram, setup: BallSetup, log: Log, simulated: float, interrupted: bool = False
) -> dict[str, Any]:
    """Returns the summary of a run, a dict of numbers, texts and None (where a value does not exist).

    Lengths are in m, times in s, angles in rad:

    - ``board_in_camera_error``, ``board_in_world_error``: errors of the initialisation: distance between the true and
      the measured origin of the board [m], and angle between the poses [rad].
    - ``position_rms_m``: error of points on the board at their stamps, from `ROLLING` after the release until the ball
      leaves the board.
    - ``vision_valid_fraction``: fraction of the centroids in this time that gave a point.
    - ``lag_s``: smallest and greatest time from the stamp of a point, midway between its two images, to the instant at
      which the prediction based on it is available.
    - ``crossing_error_m``: {time before the crossing [s]: predicted minus true position on the edge}, for the newest
      packet at that time.
    - ``hand_error_m``: position across of the middle of the cup when the ball leaves the board, minus the position at
      which the ball passes over the cup.
    - ``roll_s``: time from the release to the crossing.
    - ``exit_speed_m_s``: speed of the ball at the crossing.
    - ``hold_s``: longest time for which the ball was in the cup, according to the judge.
    - ``board_touched``: whether the arm touched the board or its table.
    - ``self_touched``: whether two links of the arm touched each other.
    - ``joint_limit_margin_rad``: smallest distance of a joint from its limit.
    - ``speed_share``: greatest fraction of the rated speed of a joint.
    - ``longest_saturation_s``: longest saturation of a drive.
    - ``packets_rejected``, ``packets_rejected_for``: see `packet_findings`.
    - ``set_points_changed``, ``set_points_changed_for``: see `limiter_findings`.

    Args:
        hand_eye: the diagram of the run, with the attribute ``poses`` and the ground truth of its world.
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        simulated: time at which the run ended [s].
        interrupted: whether the user ended the run.
    """
    laboratory, camera = hand_eye.world.laboratory, hand_eye.world.cameras[NAME]
    X_CB = camera.X_WC.inverse() @ laboratory.X_WB
    verdicts = log["truth_verdict"]
    last = last_verdict(log)
    success = bool(last.caught)
    crossing = float(last.crossing_time) or None
    hand_error = None
    if crossing:
        hand_error = float(across(hand_eye, log["tool"], crossing) - over_the_cup(hand_eye, setup, log, last))
    summary = {
        "scenario": setup.scenario.name,
        "seed": setup.scenario.seed,
        "success": success,
        "failure_reason": None if success else failure_reason(last, hand_error, interrupted),
        "board_in_camera_error": pose_error(hand_eye.poses.X_CB, X_CB),
        "board_in_world_error": pose_error(hand_eye.poses.X_WB, laboratory.X_WB),
        **_positions(hand_eye, log, last),
        "crossing_error_m": crossing_errors(hand_eye, setup, log, last),
        "hand_error_m": hand_error,
        "roll_s": crossing - last.released if crossing else None,
        "exit_speed_m_s": _exit_speed(log, crossing),
        "hold_s": max(verdicts["held"], default=0.0),
        "board_touched": bool(last.board_touched),
        "self_touched": bool(last.self_touched),
        **arm_findings(log, limits_of(setup.arm)),
        **packet_findings(log),
        **limiter_findings(log),
        "lag_s": lag_of(log, setup.scenario.time_step),
        "simulated_s": simulated,
        "interrupted": bool(interrupted),
        **made_by(),
    }
    return tidy(summary)


def last_verdict(log: Log) -> Any:
    """Returns the last `CatchVerdict` of a log, all zeros when there is none."""
    return last_message(log["truth_verdict"], CatchVerdict)


def failure_reason(verdict: Any, hand_error: float | None, interrupted: bool) -> str:
    """Returns in one sentence why the ball was not caught.

    Args:
        verdict: the last `CatchVerdict` of the run.
        hand_error: error of the hand across [m], None when it is not known.
        interrupted: whether the user ended the run.
    """
    if not verdict.released:
        reason = "the ball was never released: the arm was not ready, or the gate stayed closed"
    elif verdict.rest_since and not verdict.crossing_time:
        reason = f"the ball jammed at a peg and came to rest on the board at x {verdict.x:.2f}, y {verdict.y:.2f} m"
    elif not verdict.crossing_time:
        over = verdict.lost and verdict.y > 0.0
        still = "the ball was still on the board when the run ended"
        reason = "the ball rolled off a side of the board" if over else still
    elif verdict.in_cup:
        reason = f"the ball had been in the cup for only {verdict.held:.2f} s when the run ended"
    elif hand_error is None:
        reason = "the ball crossed the edge, but the position of the hand was not logged"
    elif abs(hand_error) > HALF_CUP:
        reason = (
            f"the cup was {1e3 * abs(hand_error):.0f} mm from the ball; at most {1e3 * HALF_CUP:.0f} mm is possible"
        )
    else:
        reason = f"the ball passed {1e3 * abs(hand_error):.0f} mm from the middle of the cup and did not stay in it"
    return f"interrupted; until then {reason}" if interrupted else reason


def across(hand_eye: HandEyeDiagram, signal: Signal, time: float) -> float:
    """Returns x_B of a logged position at one time [m], in the true frame of the board.

    Args:
        hand_eye: the diagram of the run.
        signal: logged position with the fields x, y, z in W [m].
        time: the time [s].
    """
    p_WQ = np.array([np.interp(time, signal.times, signal[axis]) for axis in "xyz"])
    return (hand_eye.world.laboratory.X_WB.inverse() @ p_WQ)[0]


def over_the_cup(hand_eye: HandEyeDiagram, setup: BallSetup, log: Log, verdict: Any) -> float:
    """Returns x_B at which the ball passes over the middle of the cup [m], straight on from where it leaves the board.

    Args:
        hand_eye: the diagram of the run.
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        verdict: the last `CatchVerdict` of the run, with a crossing.
    """
    truth, R_WB = log["truth_ball_state"], hand_eye.world.laboratory.X_WB.rotation().matrix()
    velocity = np.array([np.interp(verdict.crossing_time, truth.times, truth[v]) for v in ("vx", "vy", "vz")])
    outward = -velocity[:2] @ R_WB[:2, 1] / np.hypot(*R_WB[:2, 1])
    drift = R_WB[:, 0] @ velocity / outward if outward > 0.0 else 0.0
    return verdict.crossing_x + drift * setup.scenario.catch.beyond


def crossing_errors(hand_eye: HandEyeDiagram, setup: BallSetup, log: Log, verdict: Any) -> dict[str, float]:
    """Returns {time before the crossing [s]: predicted minus true x_B [m]}, where a crossing was predicted.

    Args:
        hand_eye: the diagram of the run.
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        verdict: the last `CatchVerdict` of the run.
    """
    found = {}
    delivered, edge = log["delivered"], setup.edge
    for before in BEFORE_CROSSING:
        index = np.searchsorted(delivered.times, verdict.crossing_time - before) - 1
        predicted = edge.crossing(delivered.data[index]) if verdict.crossing_time and index >= 0 else None
        if predicted is not None:
            x, _, _ = hand_eye.world.laboratory.X_WB.inverse() @ predicted.p_WQ
            found[f"{before:g}"] = float(x - verdict.crossing_x)
    return found


def _positions(hand_eye: HandEyeDiagram, log: Log, verdict: Any) -> dict[str, float | None]:
    point, truth = log["point"], log["truth_ball_state"]
    end = verdict.crossing_time or np.inf
    fresh = np.diff(point["stamp"], prepend=0.0) > 0.0
    rolling = fresh & (point["stamp"] > verdict.released + ROLLING) & (point["stamp"] < end)
    if not verdict.released or not rolling.any():
        return {"position_rms_m": None, "vision_valid_fraction": None}
    valid = rolling & (point["valid"] > 0)
    p_WQ = np.column_stack([np.interp(point["stamp"][valid], truth.times, truth[axis]) for axis in "xyz"])
    error = (point.view("x", "y", "z")[valid] - p_WQ) @ hand_eye.world.laboratory.X_WB.rotation().matrix()
    square = np.sum(error[:, :2] ** 2, axis=1)
    return {
        "position_rms_m": float(np.sqrt(square.mean())) if len(square) else None,
        "vision_valid_fraction": np.count_nonzero(valid) / np.count_nonzero(rolling),
    }


def _exit_speed(log: Log, crossing: float | None) -> float | None:
    if not crossing:
        return None
    truth = log["truth_ball_state"]
    return float(np.linalg.norm([np.interp(crossing, truth.times, truth[v]) for v in ("vx", "vy", "vz")]))
