"""The summary of a run of the ball: what came of it, and how well each part did, judged from truth after the event."""

from typing import Any

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import CatchVerdict
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.ball.diagram import known_edge
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.episode import Log
from drake_tracker.tasks.results import git_commit, lag_of, package_versions, tidy
from drake_tracker.vision.board_poses import pose_error

ROLLING = 0.10
"""Time [s] after the release from which the ball is seen to move."""
BEFORE_CROSSING = (0.4, 0.25, 0.1)
"""Times [s] before the ball leaves the board at which the foreseen crossing is judged."""
HALF_CUP = 0.030
"""How far [m] across the ball may be from the middle of the cup and fall in without touching its rim."""


def summarise_ball(
    hand_eye: HandEyeDiagram, scenario: BallScenario, log: Log, simulated: float, interrupted: bool = False
) -> dict[str, Any]:
    """Returns the summary of a run of the ball as a dict of numbers, texts and None (where there is nothing to say).

    Lengths in m, times in s, angles in rad:

    - ``board_in_camera_error``, ``board_in_world_error``: of the initialisation, against truth: distance of the
      board's origins [m] and angle between the poses [rad].
    - ``position_rms_m``: points on the board against the ball at their stamps, from `ROLLING` after its release until
      it leaves the board; ``vision_valid_fraction``: share of the centroids of that time that gave a point.
    - ``lag_s``: from a point's stamp to the instant at which the prediction built on it can be read.
    - ``crossing_error_m``: {time before the crossing [s]: across on the edge, foreseen minus true}, of the newest
      packet then.
    - ``hand_error_m``: across, the cup's middle when the ball leaves the board, minus where the ball then goes over it.
    - ``roll_s``, ``exit_speed_m_s``: of the ball; ``hold_s``: longest time in the cup, as judged.

    Args:
      hand_eye: the diagram, with its ``poses`` and its world's truth. scenario: the run's. log: {name: Signal}.
      simulated: time at which the run ended [s]. interrupted: whether the user ended it.
    """
    laboratory, camera = hand_eye.world.laboratory, hand_eye.world.camera
    X_CB = camera.X_WC.inverse() @ laboratory.X_WB
    verdicts = log["truth_verdict"]
    last = last_verdict(log)
    success = bool(last.caught)
    crossing = float(last.crossing_time) or None
    hand_error = None
    if crossing:
        hand_error = float(across(hand_eye, log["tool"], crossing) - over_the_cup(hand_eye, scenario, log, last))
    summary = {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "success": success,
        "failure_reason": None if success else failure_reason(last, hand_error, interrupted),
        "board_in_camera_error": pose_error(hand_eye.poses.X_CB, X_CB),
        "board_in_world_error": pose_error(hand_eye.poses.X_WB, laboratory.X_WB),
        **_positions(hand_eye, log, last),
        "crossing_error_m": crossing_errors(hand_eye, scenario, log, last),
        "hand_error_m": hand_error,
        "roll_s": crossing - last.released if crossing else None,
        "exit_speed_m_s": _exit_speed(log, crossing),
        "hold_s": max(verdicts["held"], default=0.0),
        "board_touched": bool(last.board_touched),
        **arm_findings(log, limits_of(arm_of(scenario))),
        "lag_s": lag_of(log, scenario.time_step),
        "simulated_s": simulated,
        "interrupted": bool(interrupted),
        "package_versions": package_versions(),
        "git_commit": git_commit(),
    }
    return tidy(summary)


def last_verdict(log: Log) -> Any:
    """Returns the last `CatchVerdict` of a log, all zero when there is none."""
    rows = log["truth_verdict"].data
    return CatchVerdict(rows[-1] if len(rows) else np.zeros(len(CatchVerdict.get_fields())))


def failure_reason(verdict: Any, hand_error: float | None, interrupted: bool) -> str:
    """Returns in words why the ball was not caught: of the last `CatchVerdict`, and the hand's error across [m]."""
    if not verdict.released:
        reason = "the ball was never released: the arm was not ready, or the gate stayed shut"
    elif verdict.rest_since and not verdict.crossing_time:
        reason = f"the ball lies still on the board, at x {verdict.x:.2f}, y {verdict.y:.2f} m: jammed at a peg"
    elif not verdict.crossing_time:
        over = verdict.lost and verdict.y > 0.0
        still = "the ball was still on the board when the run ended"
        reason = "the ball went over a side of the board" if over else still
    elif verdict.in_cup:
        reason = f"the ball was in the cup for {verdict.held:.2f} s when the run ended"
    elif hand_error is None:
        reason = "the ball crossed the edge, but the position of the hand was not logged"
    elif abs(hand_error) > HALF_CUP:
        reason = f"the cup stood {1e3 * abs(hand_error):.0f} mm beside the ball, and {1e3 * HALF_CUP:.0f} mm fit"
    else:
        reason = f"the ball came {1e3 * abs(hand_error):.0f} mm from the middle of the cup and did not stay in it"
    return f"interrupted; until then {reason}" if interrupted else reason


def across(hand_eye: HandEyeDiagram, signal: Signal, time: float) -> float:
    """Returns x_B [m] of a logged place (fields x, y, z in W) at a time [s], on the board as it truly stands."""
    p_WQ = np.array([np.interp(time, signal.times, signal[axis]) for axis in "xyz"])
    return (hand_eye.world.laboratory.X_WB.inverse() @ p_WQ)[0]


def over_the_cup(hand_eye: HandEyeDiagram, scenario: BallScenario, log: Log, verdict: Any) -> float:
    """Returns where the ball truly goes over the cup's middle, x_B [m]: straight on from where it leaves the board."""
    truth, R_WB = log["truth_ball_state"], hand_eye.world.laboratory.X_WB.rotation().matrix()
    velocity = np.array([np.interp(verdict.crossing_time, truth.times, truth[v]) for v in ("vx", "vy", "vz")])
    outward = -velocity[:2] @ R_WB[:2, 1] / np.hypot(*R_WB[:2, 1])
    drift = R_WB[:, 0] @ velocity / outward if outward > 0.0 else 0.0
    return verdict.crossing_x + drift * scenario.catch.beyond


def crossing_errors(hand_eye: HandEyeDiagram, scenario: BallScenario, log: Log, verdict: Any) -> dict[str, float]:
    """Returns {time before the crossing [s]: foreseen minus true x_B [m]}, where a crossing was foreseen then."""
    found = {}
    delivered, edge = log["delivered"], known_edge(scenario, hand_eye.poses)
    for before in BEFORE_CROSSING:
        index = np.searchsorted(delivered.times, verdict.crossing_time - before) - 1
        foreseen = edge.crossing(delivered.data[index]) if verdict.crossing_time and index >= 0 else None
        if foreseen is not None:
            x, _, _ = hand_eye.world.laboratory.X_WB.inverse() @ foreseen.p_WQ
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
