"""What an open track must offer besides its shape: a table under the train, and time enough for a grasp."""

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.train.grasp_machine import SEEN_FOR
from drake_tracker.tasks.train.reach import CHECKED_PLACES, Reach
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.vision.region_of_interest import is_within
from drake_tracker.world.train.plant import TABLE_TOP, WHEELS
from drake_tracker.world.train.rail import END_MARGIN
from drake_tracker.world.train.speed_law import distance_at
from drake_tracker.world.train.tracks import Track

_TIMES = 2000
"""Number of instants at which the distance travelled is computed."""


def off_table(track: Track, start: float, scale: float = 1.0) -> tuple[float, float] | None:
    """Returns a place (x, y) in W at which a wheel of the train, or an end of the rails, is beyond the table [m].

    Args:
        track: the track in the direction of travel.
        start: arc length at which the train starts [m].
        scale: length of the train relative to its model.

    Returns None when the table supports the train from its start to where it stops.
    """
    s = np.linspace(start, max(last_place(track, scale), start), CHECKED_PLACES)
    if track.closed:
        s = np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False)
    x, y, heading = track.pose(s)
    cos, sin = np.cos(heading), np.sin(heading)
    places = [np.column_stack(track.pose(np.array([0.0, track.length]))[:2])]
    for along in (-scale * WHEELS[0], scale * WHEELS[0]):
        for across in (-WHEELS[1], WHEELS[1]):
            places.append(np.column_stack([x + along * cos - across * sin, y + along * sin + across * cos]))
    points = np.concatenate(places)
    beyond = ((points < TABLE_TOP[0]) | (points > TABLE_TOP[1])).any(axis=1)
    return tuple(points[np.argmax(beyond)].tolist()) if beyond.any() else None


def last_place(track: Track, scale: float = 1.0) -> float:
    """Returns the arc length [m] at which a train, ``scale`` times as long as its model, stops on an open track."""
    return track.length - scale * END_MARGIN


def time_within_reach(scenario: TrainScenario, track: Track, start: float, reach: Reach) -> float:
    """Returns the time [s] for which a train on an open track is in the work volume and within the arm's reach.

    It is the longest uninterrupted time of its passage, and infinite for a train at rest.

    Args:
        scenario: the scenario with the work volume and the speed.
        track: the track in the direction of travel.
        start: arc length at which the train starts [m].
        reach: reach of the scenario's arm.
    """
    config, vision = scenario.track, scenario.vision
    if config.speed == 0.0:
        return np.inf
    s = np.linspace(start, max(last_place(track, scenario.train.scale), start), CHECKED_PLACES)
    x, y, _ = track.pose(s)
    good = is_within(vision.work_volume, vision.outline, np.column_stack([x, y])) & reach.reached(track, s)
    # A speed law that rests now and then still covers half of the distance of its full speed.
    times = np.linspace(0.0, 2.0 * track.length / config.speed + 1.0, _TIMES)
    travelled = [distance_at(config.speed_law, config.speed, config.variation, t) for t in times]
    passed = np.interp(s - start, travelled, times)
    longest, since = 0.0, np.inf
    for time, here in zip(passed, good):
        since = min(since, time) if here else np.inf
        longest = max(longest, time - since)
    return float(longest)


def shortest_grasp(scenario: TrainScenario) -> float:
    """Returns the time [s] that a grasp takes at least, from the first image of the train to the touch of the pads."""
    config = scenario.grasp
    seen = scenario.vision.lag_cycles * VISION_PERIOD + SEEN_FOR
    above = config.approach_duration + config.settle_time
    return seen + above + config.descent_duration - config.closing_lead + touch_delay(config)
