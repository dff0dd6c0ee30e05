"""When to go for it: every reason to wait a little longer, asked in order.

The hand is committed from the start of the descent until the pads touch, without sight, so that the prediction made at
launch must hold for the whole *horizon*: the age of what was seen, the descent and the closing.
"""

from enum import IntEnum

import numpy as np

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.differential_ik import rehearse
from drake_tracker.arm.transform_equation import share_done
from drake_tracker.core.messages import KNOT_COUNT, evaluate_prediction, prediction_knots
from drake_tracker.grasp.prediction_memory import (
    ALONG,
    LATERAL,
    STAMP,
    THERE_X,
    THERE_Y,
    THERE_YAW,
    TURN,
    X,
    Y,
    recall,
    recent,
)

RECENT = 2.5
"""An open track is judged by the packets stamped within so much time [s] before the present."""
ONE_PASS = 1.0
"""Records of the newest earlier pass of a place are no more than this [s] apart."""
TRUSTED_FOR = 1.0
"""A filter that is sure of itself must have been right in all that it said so long [s]."""
FEWEST_RECORDS = 3
"""Fewer judged predictions than this from one place prove nothing."""
FOLLOWING_ERROR = 0.004
"""An arm that falls behind its set-points by more than this [m] in rehearsal cannot make the motion."""
STARTING = 1.0
"""Places of the first so many seconds do not say whether a path is straight: the filter had hardly begun."""
_ALONG_PACKET = np.linspace(0.0, KNOT_COUNT - 1, 5 * (KNOT_COUNT - 1) + 1)
"""Places on the predicted path, as numbers of knots, that are held against where the object went before."""


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


def touch_delay(parameters):
    """Returns the time [s] from the start of closing until the pads touch an object in the middle of the jaws."""
    return (parameters.jaw_opening - parameters.object_width) / parameters.jaw_speed


def horizon(parameters, target):
    """Returns the time [s] from the newest measurement to the instant at which the pads would touch."""
    blind = parameters.descent_duration - parameters.closing_lead + touch_delay(parameters)
    return target.time - target.stamp + blind


def judge_prediction(parameters, memory, packet, target):
    """Returns the gate's verdict on a prediction, and the worst lateral error [m] of those that vouch for it.

    Two things can: predictions made from the same place earlier that came true, and the filter's own idea of its error
    at the instant of the grasp, if what it said lately came true. Only a filter that knows the path ahead can be as
    sure as ``std_tolerance``; one that extrapolates knows that it cannot see the next bend.
    """
    verdict, worst = judge_memory(parameters, memory, packet, target)
    if verdict == Gate.OPEN or parameters.gate == "memory":
        return verdict, worst
    std = evaluate_prediction(packet, target.stamp + horizon(parameters, target))[4]
    if std <= parameters.std_tolerance:
        own = came_true(parameters, recent(memory, target.stamp, TRUSTED_FOR + horizon(parameters, target)))
        if own[0] == Gate.OPEN:
            return own
    return verdict, worst


def judge_memory(parameters, memory, packet, target):
    """Returns the gate's verdict on the predictions made earlier, and the worst lateral error [m] among those asked.

    On a place passed before, those of the newest earlier pass are asked, and whether the packet leads where the object
    went then: a filter that was right may be wrong this time. On a path that has been straight all along (an open
    track), or when told so, the recent predictions are asked.
    """
    rows = recall(memory, packet, parameters.memory_radius)
    if parameters.gate == "recent" or (
        parameters.gate == "auto" and len(rows) == 0 and is_straight(parameters, memory, packet)
    ):
        return came_true(parameters, recent(memory, target.stamp, RECENT))
    if len(rows):
        rows = rows[rows[:, STAMP] >= rows[:, STAMP].max() - ONE_PASS]
    verdict, worst = came_true(parameters, rows)
    if verdict == Gate.OPEN:
        lateral, turn = strays(packet, rows)
        worst = max(worst, lateral)
        if lateral > parameters.lateral_tolerance or turn > np.deg2rad(parameters.turn_tolerance_deg):
            verdict = Gate.PREDICTIONS_FAILED
    return verdict, worst


def strays(packet, rows):
    """Returns how far at most [m, rad] the predicted path passes by the places to which the object went in the records
    of ``rows`` made nearest to where the packet starts."""
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


def came_true(parameters, rows):
    """Returns the gate's verdict on records of predictions, and the worst lateral error [m] among them."""
    if len(rows) < FEWEST_RECORDS:
        return Gate.NO_MEMORY, 0.0
    worst = np.max(np.abs(rows), axis=0)
    good = (
        worst[LATERAL] <= parameters.lateral_tolerance
        and worst[ALONG] <= parameters.along_tolerance
        and worst[TURN] <= np.deg2rad(parameters.turn_tolerance_deg)
    )
    return (Gate.OPEN if good else Gate.PREDICTIONS_FAILED), float(worst[LATERAL])


def is_straight(parameters, memory, packet):
    """Whether all of the path seen so far was one straight line, of ``straight_length`` [m] at least.

    A straight after a bend does not count: on a closed track the next bend comes soon.
    """
    waiting = [(old[0], *prediction_knots(old)[0][:2]) for old in memory.waiting]
    seen = np.vstack([memory.records[:, [STAMP, X, Y]], *waiting])
    away = seen[seen[:, 0] >= seen[:, 0].min(initial=np.inf) + STARTING, 1:] - prediction_knots(packet)[0][:2]
    distances = np.hypot(*away.T)
    if distances.max(initial=0.0) < parameters.straight_length:
        return False
    dx, dy = away[np.argmax(distances)] / distances.max()
    return bool(np.max(np.abs(away @ np.array([-dy, dx]))) <= parameters.straight_tolerance)


def can_follow(parameters, model, ik_parameters, q, packet, start, from_height, half_turns):
    """Rehearses the descent and the closing on the predicted path, and says whether the arm can follow.

    Args:
      q: joint set-points [rad] now. start: the instant [s] they are due. from_height: of the hand above the object [m].
      half_turns: the jaws' branch.
    """
    period = ik_parameters.get_time_step()
    blind = parameters.descent_duration + touch_delay(parameters)
    poses = []
    for k in range(1, int(np.ceil(blind / period)) + 1):
        x, y, z, yaw, _ = evaluate_prediction(packet, start + k * period)
        drop = share_done(k * period / parameters.descent_duration)
        height = from_height + (parameters.grasp_height - from_height) * drop
        poses.append(tool_down((x, y, z + height), yaw + np.pi * half_turns))
    return rehearse(model, ik_parameters, q, poses, FOLLOWING_ERROR)
