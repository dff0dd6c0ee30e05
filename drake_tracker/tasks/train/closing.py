"""Timing and position of the jaws when they closed, measured against ground truth after the run."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.core.messages import Prediction, evaluate_prediction, prediction_end
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, tool_pose
from drake_tracker.tasks.train.diagnosis.judged_train import FIRST_TRAIN
from drake_tracker.tasks.train.episode import train_places, train_pose
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.world.config import body_size
from drake_tracker.world.train.speed_law import distance_at

SHARE_ALONG = 5.0 / 6.0
"""Greatest distance along the faces of the jaws at which the middle of a train can still be gripped, as a share of half
of its length: 0.05 m for a train of scale 1."""
LATEST = 0.15
"""Time [s] after the expected touch of the pads up to which a contact belongs to the closing."""
_STEP = 0.001
"""Time step at which paths are compared [s]."""


class Contact(NamedTuple):
    """When the jaws touched the train.

    Attributes:
        time: of the first contact since the launch or, without one, the instant at which the pads would have touched
            the sides of a train in the middle of the jaws [s].
        made: whether there was a contact.
    """

    time: float
    made: bool


def clearance(setup: TrainSetup) -> float:
    """Returns the greatest distance across the open jaws, from their middle, at which the train still fits [m]."""
    return 0.5 * (setup.grasp.jaw_opening - setup.grasp.object_width)


def closing_onset_error(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> float | None:
    """Returns the start of the last closing command relative to the last instant at which it could succeed [s].

    A negative value is early enough. The last possible instant follows from ground truth, as if hand and train did not
    touch: the hand continues along the path frozen at the launch (the servo's target and, beyond the end of the log,
    the packet on which it is based), and the train continues along its track according to its speed law. The middle of
    the train leaves the space between the open jaws when it is more than `clearance` across or `SHARE_ALONG` of half of
    its length along the jaws from their middle. The pads must touch by then, hence closing must begin earlier by the
    travel time of the jaws. If the train has not left when the path of the packet ends, the end of the path is used.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.

    Returns None if the jaws never closed, if the hand was not over the train at the launch, or if the log is about
    another object than the first train.
    """
    if FIRST_TRAIN in log:
        return None
    launch, close = last_closing(spans)
    if launch is None or close is None:
        return None
    turns = setup.scenario.track.turns
    times, hand = _frozen_path(log, launch.start, turns)
    (launched,) = train_pose(log, [launch.start])
    if len(times) < 2 or np.isnan(launched).any():
        return None
    track, _ = setup.placement
    config = setup.scenario.track
    law = (config.speed_law, config.speed, config.variation)
    gone = np.array([distance_at(*law, t, setup.scenario.train.start_delay) for t in (launch.start, *times)])
    near = train_places(setup, log, launch.start)[-1, 0]
    x, y, yaw = launched[[0, 1, 3]].tolist()
    s = track.locate(x, y, turns * math.cos(yaw), turns * math.sin(yaw), near)[0]
    ahead_x, ahead_y, _ = track.pose(s + gone[1:] - gone[0])
    along, across = _in_hand(hand, ahead_x, ahead_y)
    length, _, _ = body_size(setup.scenario.train.body, setup.scenario.train.scale)
    fits = (np.abs(across) <= clearance(setup)) & (np.abs(along) <= 0.5 * SHARE_ALONG * length)
    if not fits[0]:
        return None
    leaves = times[-1] if fits.all() else times[np.argmin(fits)]
    return float(close.start - (leaves - touch_delay(setup.grasp)))


def contact_of(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> Contact | None:
    """Returns the contact of the last attempt in which the jaws closed, None if they never closed.

    Arguments as for `closing_onset_error`.
    """
    launch, close = last_closing(spans)
    if launch is None or close is None:
        return None
    touch = close.start + touch_delay(setup.grasp)
    contacts = _contacts(log, launch.start, touch + LATEST)
    return Contact(float(contacts[0]), True) if len(contacts) else Contact(touch, False)


def offset_at_touch(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> tuple[float, float, float] | None:
    """Returns the train's middle relative to the middle of the jaws at touch, (along [m], across [m], turned by [rad]).

    The instant is the first contact since the last launch, or otherwise the instant at which the pads would have
    touched the sides of the train. Arguments as for `closing_onset_error`.

    Returns None if the jaws never closed, or if a pose is not logged.
    """
    launch, close = last_closing(spans)
    if launch is None or close is None:
        return None
    touch = close.start + touch_delay(setup.grasp)
    early = _contacts(log, launch.start, touch)
    when = [early[0] if len(early) else touch]
    (train,), hand = train_pose(log, when), tool_pose(log, when)
    along, across = _in_hand(hand[:, [0, 1, 3]], train[0], train[1])
    turn = math.remainder(train[3] - hand[0, 3], math.pi)  # half a turn of the hand makes no difference
    return None if np.isnan(along[0] + across[0]) else (float(along[0]), float(across[0]), turn)


def aborted_launches(spans: Sequence[PhaseSpan], log: Log, object_width: float) -> tuple[float, ...]:
    """Returns when the descents began that were aborted before the jaws were as close as the object is wide [s].

    Args:
        spans: phases of the run.
        log: {name: Signal} of the run.
        object_width: width of the object between the jaws [m].
    """
    command = log["command"]
    found = []
    for k, span in enumerate(spans[:-1]):
        later = [each.phase for each in spans[k + 1 : k + 3]]
        if span.phase != Phase.INTERCEPT:
            continue
        if later[0] == Phase.CLOSE and later[1:] == [Phase.RETREAT]:
            closing = (command.times > spans[k + 1].start) & (command.times < spans[k + 1].end)
            if command["jaw_width"][closing].min(initial=np.inf) > object_width:
                found.append(span.start)
        elif later[0] == Phase.RETREAT:
            found.append(span.start)
    return tuple(found)


def last_closing(spans: Sequence[PhaseSpan]) -> tuple[PhaseSpan, PhaseSpan] | tuple[None, None]:
    """Returns the phases (INTERCEPT, CLOSE) of the last attempt in which the jaws closed, or (None, None)."""
    for before, span in reversed(list(zip(spans, spans[1:]))):
        if span.phase == Phase.CLOSE and before.phase == Phase.INTERCEPT:
            return before, span
    return None, None


def _contacts(log: Log, start: float, end: float) -> np.ndarray:
    """Returns the times [s] from ``start`` to before ``end`` at which a finger touched the train."""
    verdict = log["truth_verdict"]
    contact = (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)
    return verdict.times[contact & (verdict.times >= start) & (verdict.times < end)]


def _frozen_path(log: Log, launch: float, turns: bool) -> tuple[np.ndarray, np.ndarray]:
    """Returns the path of the hand that was frozen at a launch.

    Args:
        log: {name: Signal} of the run.
        launch: time of the launch [s].
        turns: whether the hand turns with the path.

    Returns (times [s], shape (n,); path (x, y, yaw) in W [m, rad], shape (n, 3)).
    """
    target = log["target"]
    same = (target.times >= launch) & (target["valid"] > 0)
    if not same.any():
        return np.zeros(0), np.zeros((0, 3))
    stamp_frozen = target["stamp"][np.argmax(same)]  # the first sample after the launch; later ones use the same packet
    same &= target["stamp"] == stamp_frozen
    known_times, known = target["time"][same], target.view("x", "y", "yaw")[same]
    end = known_times[-1]
    delivered = log["delivered"]
    rows = np.nonzero((delivered["stamp"] == stamp_frozen) & (delivered["valid"] > 0))[0]
    if len(rows):
        packet = delivered.data[rows[0]]
        end, spacing = prediction_end(packet), Prediction(packet).spacing
        later = np.append(np.arange(known_times[-1] + spacing, end, spacing), max(end, known_times[-1]))
        beyond = [evaluate_prediction(packet, t)[[0, 1, 3]] for t in later]
        known_times, known = np.concatenate([known_times, later]), np.concatenate([known, beyond])
    times = np.arange(known_times[0], end, _STEP)
    known[:, 2] = np.unwrap(known[:, 2]) if turns else known[0, 2]
    return times, np.column_stack([np.interp(times, known_times, row) for row in known.T])


def _in_hand(hand: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns (along, across) [m] of points relative to poses of the hand, each of shape (n,).

    Args:
        hand: poses (x, y, yaw) in W [m, rad], shape (n, 3).
        x: x of the points in W [m], shape (n,).
        y: y of the points in W [m], shape (n,).
    """
    dx, dy = x - hand[:, 0], y - hand[:, 1]
    cos, sin = np.cos(hand[:, 2]), np.sin(hand[:, 2])
    return cos * dx + sin * dy, cos * dy - sin * dx
