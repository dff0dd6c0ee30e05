"""A future or present descent: the packet that it relies on, its end, and its probability of success.

The jaws hold the object if, when the pads touch, it is between them, with both pads beside it and not too oblique. For
an object that does not turn, the servo's packets give its constant direction, so that 'across' and 'along' mean across
and along the jaws; its direction has no error, and an error along them can be a surprise. The errors across and along
the path and in direction are independent. Each is normal with an unknown scale: the estimator states a standard
deviation, and the errors of its recent predictions say how far this is to be trusted. The error of the next prediction
then has Student's distribution, whose tails are heavier than the tails of a normal distribution.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtr

from drake_tracker.core.messages import evaluate_prediction
from drake_tracker.grasp.config import GraspConfig, touch_delay
from drake_tracker.grasp.corner_memory import after_corners
from drake_tracker.grasp.prediction_memory import (
    ALONG,
    HEIGHT,
    HEIGHT_LIMIT,
    LATERAL,
    STAMP,
    STD,
    TURN,
    PredictionMemory,
    X,
    Y,
    recent,
)

OBLIQUE = math.radians(40.0)
"""Largest error in direction [rad] that does not count as a miss. This and `TRUST` were chosen on 70 launches, seeds
81000 to 81069, which no result uses. The jaws themselves tolerate less: turned by 15 deg throughout the descent they
lifted 12 of 12 trains, by 20 deg 8, by 25 deg 5 (measured vision, oval, 0.15 m/s, seeds 940 to 945). But the standard
deviation of the direction, which is computed from the standard deviation of the position, is too large by about the
same factor. With a limit of 20 deg the mean probability of 83 launches was 69 %, with 40 deg 88 %, and 94 % of the
trains were lifted."""
TRUST = 2.0
"""Number of independent errors that the standard deviation stated by the estimator is worth."""
PRIOR_SURPRISES = 0.3
"""Surprises that an object is expected to have caused before it was seen. With 0.3, ovals and stadiums are grasped as
early as with 0; with 0.5, 0.3 s or a lap later. Chosen on seeds 71000 to 71004, which no result uses."""
CALIBRATION = {"guided": (0.97, 0.56, 0.62), "blind": (0.23, 0.2, 0.67), "belt": (1.55, 0.26, 0.26)}
"""{descent: constants of `calibrated`}, fitted to 2,726 launches of `train:guided`, 1,400 of `train:learned` and
2,231 of `conveyor:measured` (`benchmarks/launches.py`, seeds 82000 to 85999; guided also 101000 to 102299). The second
constant of "blind" is chosen: with 0, the best one by 1.3 nats, no descent would be hopeless."""
SHORTEST = 0.01
"""Distance [m] from which on the direction of travel follows from the path; an object that stands keeps its own."""


class Offset(NamedTuple):
    """By how much the hand will miss an object that moves exactly as predicted.

    Attributes:
        across: to the left of the object [m].
        along: ahead of the object [m].
        turn: counterclockwise [rad].
    """

    across: float = 0.0
    along: float = 0.0
    turn: float = 0.0


def success_probability(
    config: GraspConfig,
    packet: np.ndarray,
    horizon: float,
    stamp: float,
    judged: np.ndarray,
    offset: Offset = Offset(),
) -> float:
    """Returns the probability that the jaws hold the object.

    The standard deviation in direction follows from the standard deviation of the position: a wrong curvature displaces
    the end of a path by half of its length times the error in direction.

    Args:
        config: opening of the jaws, width and length of the object.
        packet: a `Prediction` vector.
        horizon: time from the measurement on which the hand relies to the touch [s].
        stamp: of the measurement [s].
        judged: records of recent predictions for this horizon, shape (n, 12), as from `prediction_memory.recent`.
        offset: by how much the hand misses the predicted place.
    """
    x0, y0 = evaluate_prediction(packet, stamp)[:2]
    x, y, _, _, std = evaluate_prediction(packet, stamp + horizon)
    travelled = math.hypot(x - x0, y - y0)
    turn = 2.0 / travelled if config.turns and travelled > SHORTEST else 0.0
    # Errors of predictions that overlap in time are nearly the same error.
    count = 1.0 + np.ptp(judged[:, STAMP]) / horizon if len(judged) else 0.0
    room = _room(config)
    errors, stated = judged[:, [LATERAL, ALONG, TURN]], judged[:, [STD]] * [1.0, 1.0, turn]
    squares = np.sum(errors**2, axis=0), np.sum(stated**2, axis=0)
    probability = 1.0
    for limit, centre, now, error, was in zip(
        (room, config.reach, OBLIQUE), offset, (std, std, turn * std), *squares, strict=True
    ):
        ratio = error / was if was > 0.0 else 1.0
        scale = now * math.sqrt((TRUST + count * ratio) / (TRUST + count))
        probability *= _within(limit, centre, scale, TRUST + count)
    return probability


def no_surprise(config: GraspConfig, records: np.ndarray, horizon: float, distance: float) -> float:
    """Returns the probability that the object does nothing unforeseen on its way to the grasp.

    A corner that begins unannounced is in no standard deviation. How often that happens is a property of the object's
    path. A *surprise* is an earlier prediction so wrong, across the path or in direction, that a grasp would have
    missed. A change of speed is none, since the hand catches up. Surprises count as a Poisson process over the distance
    travelled, of unknown rate with the prior density ``rate ** (PRIOR_SURPRISES - 1)``. An object at rest cannot cause
    any.

    Args:
        config: opening of the jaws and width of the object.
        records: all records about the object, oldest first, shape (n, 12).
        horizon: time for which the predictions were made [s]. Errors less than this apart have the same cause.
        distance: distance that the object will travel from the measurement to the touch [m].
    """
    stamps = records[is_wrong(config, records), STAMP]
    count = int(np.count_nonzero(np.diff(stamps, prepend=-np.inf) > horizon))
    travelled = float(np.sum(np.hypot(np.diff(records[:, X]), np.diff(records[:, Y]))))
    if travelled == 0.0:
        return float(count == 0)
    return (travelled / (travelled + distance)) ** (count + PRIOR_SURPRISES)


def is_wrong(config: GraspConfig, records: np.ndarray, offset: Offset = Offset()) -> np.ndarray:
    """Returns which predictions were so wrong that a grasp would have missed, shape (n,) of bool.

    Args:
        config: as for `no_surprise`.
        records: as for `no_surprise`.
        offset: by how much the hand would have missed the predicted place.
    """
    wrong = (np.abs(records[:, LATERAL] + offset.across) > _room(config)) | (np.abs(records[:, TURN]) > OBLIQUE)
    wrong |= np.abs(records[:, HEIGHT]) > HEIGHT_LIMIT
    if not config.turns:
        wrong |= np.abs(records[:, ALONG] + offset.along) > config.reach
    return wrong


def _room(config: GraspConfig) -> float:
    """Returns the largest error across the path at which both pads come down beside the object [m]."""
    return 0.5 * (config.jaw_opening - config.object_width)


def _within(limit: float, centre: float, scale: float, freedom: float) -> float:
    """Returns the probability that the magnitude of an error is below a limit."""
    if scale <= 0.0:
        return float(abs(centre) <= limit)
    return float(stdtr(freedom, (limit - centre) / scale) - stdtr(freedom, (-limit - centre) / scale))


JUDGED_FOR = 1.5
"""Time [s] over which predictions are judged."""
RESPONSE = 0.06
"""Time [s] that a guided hand takes to follow a new packet."""
CATCHING_UP = 0.4
"""Speed [m/s] at which a guided hand can catch up with an object."""
BESIDE = 0.040
"""Height of the tool above the object [m] from which on the fingers are beside it."""


def horizon(config: GraspConfig, target: Any) -> float:
    """Returns the time [s] from the last measurement that the hand can follow to the instant at which the pads touch.

    In a blind descent this is the newest one at the launch. A guided hand follows measurements until shortly before the
    touch.

    Args:
        config: durations of the descent and the closing.
        target: a `ServoTarget`.
    """
    blind_time = RESPONSE if config.descent == "guided" else time_to_touch(config)
    return target.time - target.stamp + blind_time


def time_to_touch(config: GraspConfig) -> float:
    """Returns the time [s] from the launch to the instant at which the pads touch."""
    return config.descent_duration - config.closing_lead + touch_delay(config)


class Likelihood(NamedTuple):
    """Probabilities that a grasp succeeds, before they are `calibrated`; 0 without a target.

    Attributes:
        now: of a grasp at this moment.
        cautious: the same, lowered in a guided descent by what has surprised on the path, which a later lap knows.
    """

    now: float = 0.0
    cautious: float = 0.0


def likelihood(
    config: GraspConfig, memory: PredictionMemory, packet: np.ndarray, target: Any, remaining: float, height: float
) -> Likelihood:
    """Returns how likely a grasp is to succeed.

    Args:
        config: durations, opening of the jaws, width of the object.
        memory: predictions made so far.
        packet: the newest `Prediction` vector.
        target: the `ServoTarget` that rests on it.
        remaining: time until the pads touch [s].
        height: height of the tool above the object [m].
    """
    if not target.valid:
        return Likelihood()
    offset = miss(packet, target, remaining, height <= BESIDE)
    judged, ahead = lately_judged(config, memory, target), horizon(config, target)
    now = success_probability(config, packet, ahead, target.stamp, judged, offset)
    if config.descent != "guided":
        return Likelihood(now, now)
    x0, y0 = evaluate_prediction(packet, target.stamp)[:2]
    x, y = evaluate_prediction(packet, target.stamp + ahead)[:2]
    calm = now * no_surprise(config, memory.records, ahead, math.hypot(x - x0, y - y0))
    wrong = is_wrong(config, memory.records, offset)
    return Likelihood(now, after_corners(memory, wrong, ahead, target.time + remaining - target.stamp, calm))


def calibrated(computed: float, descent: str) -> float:
    """Returns the share of such grasps that succeed.

    The computed probability orders grasps well. But its tolerances are cautious, and it does not know everything that
    makes grasps miss. The logit of the share is a + b ln(computed) - c ln(1 - computed) (beta calibration, Kull, Silva
    Filho and Flach 2017).

    Args:
        computed: a probability of a `Likelihood`, or of the belt.
        descent: "guided", "blind" or "belt".
    """
    if not 0.0 < computed < 1.0:
        return computed
    a, b, c = CALIBRATION[descent]
    odds = math.exp(a) * computed**b / (1.0 - computed) ** c
    return odds / (1.0 + odds)


def lately_judged(config: GraspConfig, memory: PredictionMemory, target: Any) -> np.ndarray:
    """Returns the records on which the probability of a grasp rests, shape (n, 12)."""
    return recent(memory, target.stamp, JUDGED_FOR + horizon(config, target))


def miss(packet: np.ndarray, target: Any, remaining: float, beside: bool) -> Offset:
    """Returns by how much the hand will miss an object that moves as the newest packet predicts.

    The hand is where the servo's target is, and approaches the predicted path within `RESPONSE`, but not faster than
    with `CATCHING_UP`. Fingers that are already beside the object push it when they are moved across.

    Args:
        packet: the newest `Prediction` vector.
        target: the `ServoTarget`.
        remaining: time until the pads touch [s].
        beside: whether the fingers are as low as the object.
    """
    across, along, turn = behind(packet, target)
    remaining = max(remaining, 0.0)
    left = math.exp(-remaining / RESPONSE)
    distance = math.hypot(across, along)
    share = max(left, 1.0 - CATCHING_UP * remaining / distance) if distance > 0.0 else 0.0
    return Offset(across if beside else share * across, share * along, left * turn)


def behind(packet: np.ndarray, target: Any) -> Offset:
    """Returns the place of a `ServoTarget` relative to the place that a `Prediction` vector predicts for the same
    time."""
    x, y, _, yaw, _ = evaluate_prediction(packet, target.time)
    dx, dy, c, s = target.x - x, target.y - y, math.cos(yaw), math.sin(yaw)
    return Offset(c * dy - s * dx, c * dx + s * dy, math.remainder(target.yaw - yaw, 2.0 * math.pi))
