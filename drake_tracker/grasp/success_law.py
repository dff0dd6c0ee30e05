"""A law that says beforehand how often a grasp of a moving object succeeds at the first attempt.

The hand relies on a prediction for a *horizon*: the lag of vision, and the time in which the hand can no longer follow.
A filter on an unknown path continues it as an arc, whose curvature is the mean over the filter's memory. A grasp
therefore succeeds where the path strays from this arc, within the horizon, by less than the jaws tolerate, if noise
does not displace the prediction and the arm can follow. Against noise, a filter needs longer chords. The error of an
arc through noisy points grows with the square of the horizon. All quantities enter as ratios.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.differential_ik import EFFORT_SHARE, SPEED_SHARE
from drake_tracker.core.timing import PATH_DURATION, SERVO_PERIOD
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.descent import RESPONSE, time_to_touch

AGE = 0.05
"""Age of a prediction when the servo relies on it, besides the lag of vision [s]; found with `LAW` on the same runs."""
TURN = math.radians(24.0)
"""Error of the direction that uses up all room between the jaws [rad]; found as `AGE`."""
SLIDE = 0.8
"""Error along the jaws that loses an object, over half of its length; found as `AGE`."""
STEP = 0.001
"""Distance between places of a path [m]."""
PATH_LENGTH = 20.0
"""Length of the path that stands for all paths of straights and bends [m]; no object comes half as far in a horizon."""
_DIRECTIONS = np.linspace(0.0, np.pi, 16, endpoint=False)


class JointShares(NamedTuple):
    """What following an object takes from the joints of an arm, as shares of what they are rated for. The hand points
    down and moves in each of m horizontal directions.

    Attributes:
        speed: share of the rated speed of each of n joints, for each m/s of the hand [s/m], shape (m, n).
        turn: the same for each rad/s of the hand about the vertical [s/rad], shape (n,).
        acceleration: largest share of a rated torque, for each m/s^2 across the direction [s^2/m], shape (m,).
    """

    speed: np.ndarray
    turn: np.ndarray
    acceleration: np.ndarray


class Law(NamedTuple):
    """The constants of the law.

    Attributes:
        memory: time over which a filter of points without noise averages the curvature of the path [s].
        chord: length of path that is averaged besides, over the standard deviation of a measured point.
        growth: horizon at which the standard deviation of a predicted place is twice that of the present place [s].
        gain: standard deviation of a place predicted for now, over the noise of a measured point.
        hand: standard deviation of what else displaces the hand from an object that is there now [m].
        limit: share of the rated speeds and torques at which half of the descents can follow.
        steepness: exponent of the share that the object demands, over this limit.
        oblique: factor of both standard deviations for an object that turns with its path and may lie obliquely.
    """

    memory: float
    chord: float
    growth: float
    gain: float
    hand: float
    limit: float
    steepness: float
    oblique: float


UNCERTAINTY = 0.2
"""Difference from the predicted share that single paths had; chosen. Populations of paths differ less, by 0.08 at most
in the cells of `benchmarks/success_law.py --part cells`."""
LAW = Law(memory=0.42, chord=10.1, growth=0.78, gain=1.13, hand=0.0034, limit=1.12, steepness=4.9, oblique=1.51)
"""Fitted to 5,304 runs on measured vision (`benchmarks/success_law.py --fit`)."""


def joint_shares(model: ArmModel, q: np.ndarray) -> JointShares:
    """Returns what following takes from the joints of an arm, in `_DIRECTIONS`.

    Args:
        model: the arm.
        q: joints with the hand over the middle of the table [rad], shape (n,).
    """
    inverse = np.linalg.pinv(model.tool_pose_and_jacobian(q)[1])
    rest = np.zeros(model.num_joints)
    held = model.drive_torques(q, rest, rest)
    speed, spare = SPEED_SHARE * model.velocity_limit, EFFORT_SHARE * (model.effort_limit - np.abs(held))
    along = [inverse @ [0.0, 0.0, 0.0, math.cos(angle), math.sin(angle), 0.0] for angle in _DIRECTIONS]
    across = [inverse @ [0.0, 0.0, 0.0, -math.sin(angle), math.cos(angle), 0.0] for angle in _DIRECTIONS]
    torques = [np.abs(model.drive_torques(q, rest, way) - held) / spare for way in across]
    turn = inverse @ [0.0, 0.0, 1.0, 0.0, 0.0, 0.0] / speed
    return JointShares(np.array(along) / speed, turn, np.max(torques, axis=1))


def strays(
    curvature: np.ndarray, distance: float, memory: float, parabola: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns where a path is, a distance ahead, relative to an arc that continues it at each of its places.

    Args:
        curvature: of the path from each place to the next, `STEP` apart [1/m], shape (n,).
        distance: from each place to the place ahead [m].
        memory: distance before each place over which the curvature of its arc is the mean [m].
        parabola: whether the filter takes the acceleration for constant; a parabola then takes the place of the arc.

    Returns:
        Offsets of the arc's end across the path and along it [m], and in direction [rad], shape (m,): places less than
        ``distance`` from the end of the path are left out, and the first ones, if there are others.
    """
    heading = np.append(0.0, np.cumsum(curvature)) * STEP
    middle = 0.5 * (heading[1:] + heading[:-1])
    path = np.append(0.0, np.cumsum(STEP * np.exp(1j * middle)))
    travelled = STEP * np.arange(len(path))
    back = max(round(memory / STEP), 1)
    starts = np.flatnonzero(travelled[:-1] + distance <= travelled[-1])
    starts = starts[min(back, len(starts) // 2) :]
    first = np.maximum(starts + 1 - back, 0)
    bend = (heading[starts + 1] - heading[first]) / (STEP * (starts + 1 - first))
    ends = travelled[starts] + distance
    there = np.interp(ends, travelled, path.real) + 1j * np.interp(ends, travelled, path.imag)
    direction = np.interp(ends, travelled, heading)
    turn = bend * distance
    ahead = 1.0 + 0.5j * turn if parabola else np.sinc(0.5 * turn / np.pi) * np.exp(0.5j * turn)
    offset = (path[starts] + distance * ahead * np.exp(1j * heading[starts]) - there) * np.exp(-1j * direction)
    difference = heading[starts] + (np.arctan(turn) if parabola else turn) - direction
    return offset.imag, offset.real, np.arctan2(np.sin(difference), np.cos(difference))


def stray_ratios(
    curvature: np.ndarray, distance: float, memory: float, room: float, reach: float | None, parabola: bool = False
) -> np.ndarray:
    """Returns how far a path strays, as a share of what the jaws tolerate, shape (m,).

    Args:
        curvature: as for `strays`.
        distance: as for `strays`.
        memory: as for `strays`.
        room: largest error across the path [m].
        reach: half of the length of an object that does not turn [m]; None for one that turns with its path: one that
            lies obliquely needs more room.
        parabola: as for `strays`.
    """
    across, along, turn = strays(curvature, distance, memory, parabola)
    beside = np.abs(across) / room
    if reach is None:
        return beside + np.abs(turn) / TURN
    return np.maximum(beside, np.abs(along) / (SLIDE * reach))


def spread(
    law: Law, noise: float | np.ndarray, horizon: float | np.ndarray, turns: bool | np.ndarray
) -> float | np.ndarray:
    """Returns the standard deviation of the object's place between the jaws [m], without what the path strays.

    Args:
        law: the constants.
        noise: standard deviation of a measured point, per axis [m].
        horizon: from a measurement until the hand no longer follows [s].
        turns: whether the object turns with its path.
    """
    growth = 1.0 + (horizon / law.growth) ** 2
    return np.hypot(law.gain * noise, law.hand) * growth * np.where(turns, law.oblique, 1.0)


def held_share(ratios: np.ndarray, width: float | np.ndarray) -> np.ndarray:
    """Returns the share of descents at whose end the object is between the jaws, if the arm can follow.

    Args:
        ratios: how far the path strays at its places, as a share of what the jaws tolerate, shape (..., m).
        width: standard deviation of the object's place (`spread`), as a share of the same, shape (...).
    """
    width = np.asarray(width)[..., None]
    return np.mean(ndtr((1.0 - ratios) / width) - ndtr((-1.0 - ratios) / width), axis=-1)


def demand(speed: float, bend: float, turns: bool, taken: JointShares) -> float:
    """Returns the share of its rated speeds and torques that the arm needs to follow an object: the largest of all
    joints, as the mean over the directions of the path.

    Args:
        speed: of the object [m/s].
        bend: rms curvature of its path [1/m].
        turns: whether it turns with its path.
        taken: by the joints of the arm.
    """
    along, turn = speed * taken.speed, speed * bend * turns * taken.turn
    shares = [np.max(np.abs(along + way * turn), axis=-1) for way in (1.0, -1.0)]
    return float(np.mean(np.maximum(shares, speed**2 * bend * taken.acceleration)))


def followed_share(law: Law, demanded: float | np.ndarray) -> float | np.ndarray:
    """Returns the share of descents that the arm can follow: the bound of a controller that predicts perfectly.

    Args:
        law: the constants.
        demanded: share of what the arm is rated for (`demand`).
    """
    return 1.0 / (1.0 + (demanded / law.limit) ** law.steepness)


class Situation(NamedTuple):
    """What decides whether a grasp succeeds.

    Attributes:
        speed: of the object [m/s].
        lag: of vision [s].
        noise: standard deviation of a measured point, per axis [m].
        curvature: of the path, as for `strays` [1/m].
        shares: what following takes from the arm.
        grasp: settings of the grasp, with the size of the object.
        known: whether the filter knows the path.
        parabola: whether it continues an unknown path as a parabola, as `AlphaBetaGamma` does, not as an arc.
    """

    speed: float
    lag: float
    noise: float
    curvature: np.ndarray
    shares: JointShares
    grasp: GraspConfig
    known: bool = False
    parabola: bool = False


def predict(law: Law, situation: Situation) -> tuple[float, float]:
    """Returns the probability that the first descent lifts the object, and the probability if every prediction were
    right: the bound that the arm sets.

    Args:
        law: the constants.
        situation: what decides.
    """
    grasp, horizon = situation.grasp, law_horizon(situation.grasp, situation.lag)
    room = 0.5 * (grasp.jaw_opening - grasp.object_width)
    reach = None if grasp.turns else grasp.reach
    speed = situation.speed
    memory = speed * law.memory + law.chord * situation.noise
    ratios = stray_ratios(situation.curvature, speed * (horizon + AGE), memory, room, reach, situation.parabola)
    ratios = np.zeros(1) if situation.known else ratios
    bend = float(np.sqrt(np.mean(situation.curvature**2)))
    followed = float(followed_share(law, demand(speed, bend, grasp.turns, situation.shares)))
    held = float(held_share(ratios, spread(law, situation.noise, horizon, grasp.turns) / room))
    return held * followed * (horizon + SERVO_PERIOD <= PATH_DURATION), followed


def law_horizon(grasp: GraspConfig, lag: float) -> float:
    """Returns the time [s] from a measurement to the instant from which on the hand no longer follows.

    Args:
        grasp: settings of the grasp.
        lag: of vision [s].
    """
    return lag + (RESPONSE if grasp.descent == "guided" else time_to_touch(grasp))


def limiting(law: Law, situation: Situation) -> dict[str, float]:
    """Returns {what limits success: the probability without it}, the largest gain first."""
    lenient = JointShares(*(0.0 * share for share in situation.shares))
    without = {
        "lag": situation._replace(lag=0.0),
        "noise": situation._replace(noise=0.0),
        "bends": situation._replace(known=True),
        "arm": situation._replace(shares=lenient),
    }
    found = {name: predict(law, other)[0] for name, other in without.items()}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def bends(curvature: float, straight: float) -> np.ndarray:
    """Returns the curvature along a path of straights and quarter bends in turn, as for `strays`.

    Args:
        curvature: of the bends [1/m]; 0: the path is straight.
        straight: length of the straights [m].
    """
    bend = min(0.5 * np.pi / curvature, 0.5 * PATH_LENGTH) if curvature > 0.0 else 0.0
    side = np.append(np.zeros(round(straight / STEP)), np.full(round(bend / STEP), curvature))
    return np.resize(side, round(PATH_LENGTH / STEP)) if len(side) else np.zeros(round(PATH_LENGTH / STEP))
