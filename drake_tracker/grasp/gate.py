"""The gate before a grasp: every reason to wait a little longer, asked in order.

In a blind descent the hand is committed until the pads touch. The prediction made at launch must then hold for the
whole *horizon*: the age of the measurement, the descent and the closing. A guided hand has a shorter one
(`descent.horizon`).
"""

from enum import IntEnum
from typing import Any

import numpy as np
from pydrake.multibody.inverse_kinematics import DifferentialInverseKinematicsParameters

from drake_tracker.arm.arm_model import ArmModel, tool_down
from drake_tracker.arm.motion.differential_ik import rehearse
from drake_tracker.arm.motion.transform_equation import LEVEL, Slope, share_done, slope_along, surface_normal
from drake_tracker.core.messages import KNOT_COUNT, evaluate_prediction, prediction_knots
from drake_tracker.grasp.config import GraspConfig, touch_delay
from drake_tracker.grasp.corner_memory import is_restless
from drake_tracker.grasp.descent import Likelihood, calibrated, horizon, is_wrong, lately_judged
from drake_tracker.grasp.prediction_memory import (
    ALONG,
    HEIGHT,
    HEIGHT_LIMIT,
    LATERAL,
    STAMP,
    THERE_X,
    THERE_Y,
    THERE_YAW,
    TURN,
    PredictionMemory,
    X,
    Y,
    places_seen,
    recall,
    recent,
)

RECENT = 2.5
"""An open track is judged by the packets stamped within this time [s] before the present."""
ONE_PASS = 1.0
"""Records of the same pass of a place are at most this [s] apart."""
TRUSTED_FOR = 1.0
"""A filter whose own standard deviation is trusted must have been right for this time [s]."""
FEWEST_RECORDS = 3
"""Fewest judged predictions from one place that count as evidence."""
FEWEST_JUDGED = 10
"""Fewest recent predictions that must have been judged before a probability opens the gate."""
LEAST_CHANCE, NEARLY = 0.4, 0.95
"""Least cautious probability with which a restless object is grasped, and share of the best one lately; chosen as
`KNOWN_BY`."""
STRICTER = (0.912, 1.0), (LEAST_CHANCE, 1.0)
"""Thresholds `GraspConfig.launch_probability`, and the least computed probability that belongs to each."""
FOLLOWING_ERROR = 0.004
"""Largest distance [m] from a set-point in rehearsal at which the arm still follows the motion."""
STARTING = 1.0
"""Places of the first seconds [s] do not tell whether a path is straight: the filter had hardly begun."""
_ALONG_PACKET = np.linspace(0.0, KNOT_COUNT - 1, 5 * (KNOT_COUNT - 1) + 1)
"""Places on the predicted path, as numbers of knots, that are compared with where the object went before."""
STANDING = 0.010
"""An object whose predicted path stays within this distance [m] of its beginning stands still."""
SLOWER = 2.5
"""Factor by which the descent to an object that stands still may be slower."""


class Gate(IntEnum):
    """Why the grasp machine waits, as logged; OPEN when nothing holds it back."""

    OPEN = 0
    NOT_TRACKING = 1
    SETTLING = 2
    FLIPPING = 3
    STALE = 4
    NO_MEMORY = 5
    PREDICTIONS_FAILED = 6
    OUT_OF_REACH = 7
    SUCCESS_UNLIKELY = 8
    SURPRISES = 9


def judge_probability(
    config: GraspConfig, memory: PredictionMemory, target: Any, likely: Likelihood, best: float = 1.0
) -> Gate:
    """Returns the verdict of the gate ``probability``.

    A restless object is grasped at a moment that is nearly as good as the best one lately: a better one will not come.

    Args:
        config: the threshold.
        memory: predictions made so far.
        target: the newest `ServoTarget`.
        likely: how likely a grasp is to succeed.
        best: highest cautious probability lately.
    """
    if len(lately_judged(config, memory, target)) < FEWEST_JUDGED:
        return Gate.NO_MEMORY
    now, cautious = (calibrated(each, config.descent) >= config.launch_probability for each in likely)
    if cautious:
        return Gate.OPEN
    least = float(np.interp(config.launch_probability, *STRICTER))
    worth = likely.cautious >= max(least, NEARLY * best)
    if worth and is_restless(memory, is_wrong(config, memory.records), horizon(config, target)):
        return Gate.OPEN
    return Gate.SURPRISES if now else Gate.SUCCESS_UNLIKELY


def judge_prediction(
    config: GraspConfig, memory: PredictionMemory, packet: np.ndarray, target: Any
) -> tuple[Gate, float]:
    """Returns the gate's verdict on a prediction, and the largest lateral error [m] of the predictions that support it.

    Two kinds of evidence count: earlier predictions from the same place that came true; and the filter's own standard
    deviation at the instant of the grasp, if its recent predictions came true. Only a filter that knows the path ahead
    can be within ``std_tolerance``. A filter that extrapolates cannot know the next bend, and its standard deviation
    shows that.

    Args:
        config: tolerances, and the evidence that is asked for.
        memory: predictions made so far.
        packet: the `Prediction` vector that is judged.
        target: the `ServoTarget` that rests on it.
    """
    verdict, worst = judge_memory(config, memory, packet, target)
    if verdict == Gate.OPEN or config.gate == "memory":
        return verdict, worst
    std = evaluate_prediction(packet, target.stamp + horizon(config, target))[4]
    if std <= config.std_tolerance:
        own = came_true(config, recent(memory, target.stamp, TRUSTED_FOR + horizon(config, target)))
        if own[0] == Gate.OPEN:
            return own
    return verdict, worst


def judge_memory(config: GraspConfig, memory: PredictionMemory, packet: np.ndarray, target: Any) -> tuple[Gate, float]:
    """Returns the gate's verdict on the predictions made earlier, and the largest lateral error [m] among them.

    At a place passed before, the predictions of the newest earlier pass must have come true, and the packet must lead
    to where the object went then: a filter that was right before may be wrong this time. On a path that has been
    straight from its beginning (an open track), or with ``gate: recent``, the recent predictions must have come true.

    Args:
        config: tolerances, and the evidence that is asked for.
        memory: predictions made so far.
        packet: the `Prediction` vector that is judged.
        target: the `ServoTarget` that rests on it.
    """
    rows = recall(memory, packet, config.memory_radius)
    if config.gate == "recent" or (config.gate == "auto" and len(rows) == 0 and is_straight(config, memory, packet)):
        return came_true(config, recent(memory, target.stamp, RECENT))
    if len(rows):
        rows = rows[rows[:, STAMP] >= rows[:, STAMP].max() - ONE_PASS]
    verdict, worst = came_true(config, rows)
    if verdict == Gate.OPEN:
        lateral, turn = strays(packet, rows)
        worst = max(worst, lateral)
        if lateral > config.lateral_tolerance or turn > np.deg2rad(config.turn_tolerance_deg):
            verdict = Gate.PREDICTIONS_FAILED
    return verdict, worst


def strays(packet: np.ndarray, rows: np.ndarray) -> tuple[float, float]:
    """Returns how far the predicted path passes from where the object went earlier: at most, across [m] and in
    direction [rad].

    Args:
        packet: a `Prediction` vector.
        rows: records of the earlier pass, shape (n, 12), of which those made nearest to the packet's start are used.
    """
    knots = prediction_knots(packet)
    x, y, yaw = (np.interp(_ALONG_PACKET, range(KNOT_COUNT), knots[:, k]) for k in (0, 1, 3))
    starts = np.hypot(rows[:, X] - x[0], rows[:, Y] - y[0])
    rows = rows[np.argsort(starts)[:FEWEST_RECORDS]]
    dx, dy = rows[:, [THERE_X]] - x, rows[:, [THERE_Y]] - y
    nearest = np.argmin(np.hypot(dx, dy), axis=1)
    here, at = (np.arange(len(rows)), nearest), yaw[nearest]
    across = np.cos(at) * dy[here] - np.sin(at) * dx[here]
    turn = rows[:, THERE_YAW] - at
    return float(np.max(np.abs(across))), float(np.max(np.abs(np.arctan2(np.sin(turn), np.cos(turn)))))


def came_true(config: GraspConfig, rows: np.ndarray) -> tuple[Gate, float]:
    """Returns the gate's verdict on records of predictions, shape (n, 12), and their largest lateral error [m]."""
    if len(rows) < FEWEST_RECORDS:
        return Gate.NO_MEMORY, 0.0
    worst = np.max(np.abs(rows), axis=0)
    good = (
        worst[LATERAL] <= config.lateral_tolerance
        and worst[ALONG] <= min(config.along_tolerance, config.reach)
        and worst[TURN] <= np.deg2rad(config.turn_tolerance_deg)
        and worst[HEIGHT] <= HEIGHT_LIMIT
    )
    return (Gate.OPEN if good else Gate.PREDICTIONS_FAILED), float(worst[LATERAL])


def is_straight(config: GraspConfig, memory: PredictionMemory, packet: np.ndarray) -> bool:
    """Returns whether the whole path seen so far was one straight line, of ``straight_length`` [m] or more.

    A straight section after a bend does not count: on a closed track the next bend comes soon.

    Args:
        config: length and tolerance of a straight path.
        memory: predictions made so far.
        packet: the newest `Prediction` vector.
    """
    seen = places_seen(memory)
    away = seen[seen[:, 0] >= seen[:, 0].min(initial=np.inf) + STARTING, 1:] - prediction_knots(packet)[0][:2]
    distances = np.hypot(*away.T)
    if distances.max(initial=0.0) < config.straight_length:
        return False
    dx, dy = away[np.argmax(distances)] / distances.max()
    return bool(np.max(np.abs(away @ np.array([-dy, dx]))) <= config.straight_tolerance)


def stands(packet: np.ndarray) -> bool:
    """Returns whether the object of a `Prediction` vector stands still."""
    knots = prediction_knots(packet)
    return bool(np.max(np.hypot(*(knots[:, :2] - knots[0, :2]).T)) <= STANDING)


def can_follow(
    config: GraspConfig,
    model: ArmModel,
    ik_parameters: DifferentialInverseKinematicsParameters,
    q: np.ndarray,
    packet: np.ndarray,
    start: float,
    from_height: float,
    half_turns: float,
    descent_duration: float,
) -> bool:
    """Rehearses the descent and the closing on the predicted path. Returns whether the arm can follow.

    A hand that follows the tilt of the path tilts to its slope at the end of the descent.

    Args:
        config: heights and durations.
        model: the controller's model of the arm.
        ik_parameters: Drake's parameters, with the period of the set-points.
        q: joint set-points now, shape (n,) [rad].
        packet: the `Prediction` vector of the path.
        start: instant for which ``q`` is due [s].
        from_height: height of the hand above the object now [m].
        half_turns: the jaws' branch.
        descent_duration: duration of the descent [s].
    """
    period = ik_parameters.get_time_step()
    blind_time = descent_duration + touch_delay(config)
    tilt: Slope = LEVEL
    if config.follow_tilt:
        first, last = (evaluate_prediction(packet, start + descent_duration + k * period)[:3] for k in (0, 1))
        tilt = slope_along((last - first) / period, LEVEL)
    poses = []
    for k in range(1, int(np.ceil(blind_time / period)) + 1):
        x, y, z, yaw, _ = evaluate_prediction(packet, start + k * period)
        drop = share_done(k * period / descent_duration)
        height = from_height + (config.grasp_height - from_height) * drop
        slope = drop * np.array(tilt)
        p_WT = (x, y, z) + height * surface_normal(slope)
        poses.append(tool_down(p_WT, yaw + np.pi * half_turns, slope))
    return rehearse(model, ik_parameters, q, poses, FOLLOWING_ERROR)
