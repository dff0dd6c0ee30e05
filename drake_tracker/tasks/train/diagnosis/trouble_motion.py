"""Trouble with the train: it stopped, turned back, was moved, or left its track before the hand touched it."""

import numpy as np

from drake_tracker.tasks.episode import Log
from drake_tracker.tasks.train.diagnosis.judged_train import FIRST_TRAIN
from drake_tracker.tasks.train.diagnosis.trouble import Cause, Trouble, troubles
from drake_tracker.tasks.train.episode import train_pose
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.tasks.train.track_placement import last_place
from drake_tracker.world.train.speed_law import speed_at

STARTING = 1.0
"""Time in which the train reaches its speed [s]."""
SLOW, FAST = 0.3, 1.6
"""A train below or above these fractions of the speed of its speed law does not follow the law."""
BESIDE = 0.010
"""Distance from the track [m] at which the train does not stand on the rail; 6 mm is the most that occurs, in the
tightest corners."""
RAISED = 0.010
"""Height above the rail [m] at which the train does not stand on it."""
CARRIED = 0.03
"""Height above the rail [m] to which a train is lifted only if it is carried."""
END_ZONE = 0.05
"""Distance before the end of an open track [m] in which the rail slows the train down."""


def motion_troubles(setup: TrainSetup, log: Log, until: float) -> list[Trouble]:
    """Returns where the train did not move as its speed law says, in order of time.

    Only the first train is watched: there is none in a log that is about another object.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        until: time until which the train is watched [s], normally the first touch of the hand.
    """
    truth, verdict = log["truth_train_state"], log["truth_verdict"]
    seen = (truth.times > STARTING) & (truth.times <= until)
    times = truth.times[seen]
    if len(times) == 0 or FIRST_TRAIN in log:
        return []
    x, y, _, yaw = train_pose(log, times).T
    vx, vy = truth.view("vx", "vy")[seen].T
    track, _ = setup.placement
    places = np.array([track.nearest(*place) for place in zip(x, y, yaw)])
    lift = np.interp(times, verdict.times, verdict["lift"])
    law = (setup.scenario.track.speed_law, setup.scenario.track.speed, setup.scenario.track.variation)
    wanted = np.array([speed_at(*law, time, setup.scenario.train.start_delay) for time in times])
    speed = np.cos(yaw) * vx + np.sin(yaw) * vy

    beside = (np.abs(places[:, 1]) > BESIDE) | (np.abs(lift) > RAISED)
    braking = not track.closed and places[:, 0] > last_place(track, setup.scenario.train.scale) - END_ZONE
    follows = ~beside & (wanted > 0.0) & ~np.asarray(braking)
    found = [
        *_beside_its_track(setup, log, times, beside, until),
        *troubles(Cause.TRAIN_REVERSED, "the train ran backwards", times, follows & (speed < -SLOW * wanted), 0.3),
        *troubles(Cause.TRAIN_STOPPED, "the train stood still", times, follows & (abs(speed) < SLOW * wanted), 0.3),
        *troubles(Cause.TRAIN_DISPLACED, "the train was pushed", times, follows & (speed > FAST * wanted), 0.05),
    ]
    if not track.closed:
        found += troubles(Cause.TRACK_END, "the train stood at the end of its track", times, braking & ~beside, 0.5)
    return sorted(found, key=lambda trouble: trouble.start)


def _beside_its_track(
    setup: TrainSetup, log: Log, times: np.ndarray, beside: np.ndarray, until: float
) -> list[Trouble]:
    """Returns the stretches in which the train was not on its track, with what became of it."""
    found = troubles(Cause.TRAIN_DISPLACED, "the train was moved", times, beside, 0.05, bridge=0.5)
    if not found or found[-1].end < times[-1] - 0.1:
        return found
    last = found.pop()
    verdict, truth = log["truth_verdict"], log["truth_train_state"]
    here = (verdict.times >= last.start) & (verdict.times <= until)
    carried = verdict["lift"][here].max(initial=0.0) > CARRIED
    if not carried:
        return [*found, Trouble(Cause.DERAILED, last.start, last.end, "the train was off its track")]
    place = np.array([np.interp(last.end, truth.times, truth[axis]) for axis in "xy"])
    low, high = (np.array(corner[:2]) for corner in setup.scenario.vision.work_volume)
    if np.all(place >= low) and np.all(place <= high):
        return [*found, Trouble(Cause.TRAIN_DISPLACED, last.start, last.end, "the train was moved off its track")]
    return [*found, Trouble(Cause.TRAIN_LOST, last.start, last.end, "the train was taken away")]
