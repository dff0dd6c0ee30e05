"""The track of a run: placed at random by the seed, and checked against table, work volume and reach of the arm.

An open track need not be within reach everywhere: the table must carry the train, and there must be time for a grasp.
"""

import itertools
import math
from collections.abc import Iterator

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.train.grasp_machine import SEEN_FOR
from drake_tracker.tasks.train.reach import CHECKED_PLACES, Reach
from drake_tracker.tasks.train.scenario import TrainScenario, grasp_of
from drake_tracker.vision.region_of_interest import footprint, is_within
from drake_tracker.world.config import TrainConfig
from drake_tracker.world.train.plant import TABLE_TOP, TRAIN_HEIGHT, wheels
from drake_tracker.world.train.rail import load_of
from drake_tracker.world.train.speed_law import distance_at
from drake_tracker.world.train.tracks import Track, make_track

STREAM = 1
"""The track's stream of random numbers: default_rng([seed, STREAM])."""
OTHER_STREAM = 60
"""Stream of random numbers of further tracks: default_rng([seed, OTHER_STREAM, number of the object])."""
WALK_STREAM = 61
"""Stream of random numbers of random walks: default_rng([seed, WALK_STREAM, train, number of the placement]).

``train`` is 0 for the first train, and otherwise 1 + number of the object."""
MOST_DRAWS = 100
"""Greatest number of random placements of a track that are tried."""
MOST_MISSED = 20
"""Greatest number of placements that are tried and turn out to be beyond the reach of the arm, a slower check."""
_TIMES = 2000
"""Number of instants at which the distance travelled is computed."""


def place_track(scenario: TrainScenario, reach: Reach | None) -> tuple[Track, float]:
    """Returns the track of a scenario and the arc length at which the train starts.

    Centre and rotation within their ranges, the direction and the start are drawn at random, where the scenario leaves
    them open. A random walk is drawn anew for each placement, within the work volume and on the table. A track that
    does not fit (see `check_track`) is placed again, unless it comes from a file. If no placement fits, the first
    placement that is only out of reach is returned, or else the first placement.

    Args:
        scenario: the scenario.
        reach: reach of the scenario's arm; not needed for a track from a file.

    Returns (track in the direction of travel, arc length of the start [m]).

    Raises DrakeTrackerError when there is no such track.
    """
    places = _placements(scenario, np.random.default_rng([scenario.seed, STREAM]), 0)
    first = next(places)
    if scenario.track.kind == "csv":
        return first
    assert reach is not None
    found, missed = first, []
    for _ in range(MOST_DRAWS):
        if misplaced(scenario, *found) is None:
            if unreachable(scenario, *found, reach) is None:
                return found
            missed.append(found)
            if len(missed) == MOST_MISSED:
                break
        found = next(places)
    return missed[0] if missed else first


def place_other_track(scenario: TrainScenario, number: int) -> tuple[Track, float]:
    """Returns the track of another train and the arc length at which that train starts [m], as `place_track` does.

    The arm need not reach it. When no placement fits, the first is returned.

    Args:
        scenario: the scenario, with the other train and its track in place of the first.
        number: place of the other train in the list of objects. Each has its own random numbers.

    Raises DrakeTrackerError when there is no such track.
    """
    places = _placements(scenario, np.random.default_rng([scenario.seed, OTHER_STREAM, number]), 1 + number)
    first = found = next(places)
    for _ in range(MOST_DRAWS):
        if misplaced(scenario, *found) is None:
            return found
        found = next(places)
    return first


def _placements(scenario: TrainScenario, rng: np.random.Generator, train: int) -> Iterator[tuple[Track, float]]:
    """Yields placements of a track and the arc length of the start [m], drawn at random one after another."""
    config = scenario.track
    offset, turn = rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0)
    backward = rng.uniform() < 0.5 if config.direction == "random" else config.direction == "backward"
    drawn = rng.uniform()
    for number in itertools.count():
        track = _placed(scenario, offset, turn, (scenario.seed, WALK_STREAM, train, number))
        track = track.reversed() if backward else track
        fraction = config.start
        if fraction < 0.0:
            fraction = drawn if track.closed else 0.0
        if config.heights:
            try:
                track = track.raised(config.heights, math.radians(config.bank_deg))
            except DrakeTrackerError as error:
                key = f"objects[{train - 1}].track.heights" if train else "track.heights"
                raise DrakeTrackerError(f"{scenario.where(key)}: {error}") from None
        yield track, fraction * track.length
        offset, turn = rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0)


def _placed(scenario: TrainScenario, offset: np.ndarray, turn: float, walk_seed: tuple[int, ...]) -> Track:
    """Returns the track of a scenario in a place given by shares (-1 to 1) of its ranges, or by the seed of a walk."""
    config = scenario.track
    if config.kind == "random_walk":
        return make_track(
            config.kind,
            length=config.length,
            corner_radius=config.corner_radius,
            straight_range=config.straight_range,
            area=walk_area(scenario),
            walk_seed=walk_seed,
        )
    return make_track(
        config.kind,
        semi_axes=config.semi_axes,
        radius=config.radius,
        straight=config.straight,
        length=config.length,
        amplitude=config.amplitude,
        wavelength=config.wavelength,
        coefficients=config.coefficients,
        csv=config.csv,
        closed=config.closed,
        centre=np.asarray(config.centre) + offset * config.centre_range,
        rotation=math.radians(config.rotation_deg + turn * config.rotation_range_deg),
    )


def walk_area(scenario: TrainScenario) -> np.ndarray:
    """Returns the convex area in W in which a random walk stays, corners anticlockwise, shape (n, 2) [m].

    It is the work volume seen from above, where the table also supports all wheels of a train with any heading.

    Args:
        scenario: the scenario with the work volume and the length of the train.

    Raises DrakeTrackerError when there is no such area.
    """
    margin = math.hypot(*wheels(scenario.train))
    (x_low, y_low), (x_high, y_high) = np.array(TABLE_TOP) + [[margin], [-margin]]
    table = np.array([[x_low, y_low], [x_high, y_low], [x_high, y_high], [x_low, y_high]], dtype=np.float32)
    volume = footprint(scenario.vision.work_volume, scenario.vision.outline).astype(np.float32)
    size, area = cv2.intersectConvexConvex(volume, table)
    if size <= 0.0:
        raise DrakeTrackerError(
            f"{scenario.where('track.kind')} = random_walk: the work volume (vision.work_volume) is not above the table"
        )
    points = area.reshape(-1, 2).astype(float)
    ahead = np.roll(points, -1, axis=0)
    anticlockwise = np.sum(points[:, 0] * ahead[:, 1] - ahead[:, 0] * points[:, 1]) > 0.0
    return points if anticlockwise else points[::-1]


def misplaced(scenario: TrainScenario, track: Track, start: float) -> str | None:
    """Returns why a track cannot lie where it is, as the rest of a sentence, or None when it can.

    Args:
        scenario: the scenario with the work volume.
        track: the track in the direction of travel.
        start: arc length at which the train starts [m].
    """
    outside = place_outside(scenario, track) if track.closed else None
    if outside is not None:
        (x_low, y_low, _), (x_high, y_high, _) = scenario.vision.work_volume
        volume = f"{scenario.vision.outline} of x {x_low:g} to {x_high:g}, y {y_low:g} to {y_high:g}"
        where = f"({outside[0]:.3f}, {outside[1]:.3f}) m"
        return f"the track passes {where}, outside the {volume} (vision.work_volume)"
    if track.heights is not None:
        highest, top = float(track.heights.max()), scenario.vision.work_volume[1][2]
        room = top - (scenario.table_height + TRAIN_HEIGHT + highest)
        if room < 0.0:
            return f"the train passes {-1e3 * room:.0f} mm above the work volume, which ends at {top:g} m"
    beyond = off_table(track, start, scenario.train, scenario.track.turns)
    if beyond is not None:
        (x_low, y_low), (x_high, y_high) = TABLE_TOP
        table = f"which covers x {x_low:g} to {x_high:g}, y {y_low:g} to {y_high:g} m"
        return f"rails or train would be beyond the table at ({beyond[0]:.3f}, {beyond[1]:.3f}) m, {table}"
    return None


def unreachable(scenario: TrainScenario, track: Track, start: float, reach: Reach) -> str | None:
    """Returns why the arm cannot grasp on a track, as the rest of a sentence, or None when it can.

    Args:
        scenario: the scenario.
        track: the track in the direction of travel.
        start: arc length at which the train starts [m].
        reach: reach of the scenario's arm.
    """
    if not track.closed and scenario.track.kind != "random_walk":
        time, needed = time_within_reach(scenario, track, start, reach), shortest_grasp(scenario)
        if time >= needed:
            return None
        return (
            f"the train is in the work volume and within the arm's reach for {time:.1f} s only, and a grasp takes "
            f"{needed:.1f} s; move or lengthen the track, or lower track.speed"
        )
    missed = reach.missed(track)
    if missed is None:
        return None
    x, y, height = missed
    where = f"({x:.3f}, {y:.3f}) m, {height:.2f} m above the train"
    return f"the track is out of the arm's reach at {where}; move or shrink it"


def place_outside(scenario: TrainScenario, track: Track) -> tuple[float, float] | None:
    """Returns a place (x, y) in W at which a track is outside the work volume [m], or None.

    Args:
        scenario: the scenario with the work volume.
        track: the track.
    """
    x, y, _ = track.pose(np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False))
    points = np.column_stack([x, y])
    within = is_within(scenario.vision.work_volume, scenario.vision.outline, points)
    return None if within.all() else tuple(points[np.argmin(within)].tolist())


def check_track(scenario: TrainScenario, track: Track, start: float, reach: Reach) -> None:
    """Checks that a train can run on a track, and that the arm can grasp it there.

    The table must support rails and train. A closed track must be inside the work volume and within reach everywhere.
    So must a random walk. Any other open track passes the arm and may begin and end where the arm cannot follow, but
    the train must be in the work volume and within reach for the time that a grasp takes.

    Args:
        scenario: the scenario.
        track: its track, as placed.
        start: arc length at which the train starts [m].
        reach: reach of its arm.

    Raises DrakeTrackerError when the track does not fit.
    """
    problem = misplaced(scenario, track, start) or unreachable(scenario, track, start, reach)
    if problem is not None:
        key = "csv" if scenario.track.kind == "csv" else "kind"
        raise DrakeTrackerError(f"{scenario.where(f'track.{key}')} = {getattr(scenario.track, key)}: {problem}")


def off_table(
    track: Track, start: float, train: TrainConfig = TrainConfig(), turns: bool = True
) -> tuple[float, float] | None:
    """Returns a place (x, y) in W at which a wheel of the train, or an end of the rails, is beyond the table [m].

    Args:
        track: the track in the direction of travel.
        start: arc length at which the train starts [m].
        train: the train.
        turns: whether it turns with the track; otherwise it lies along x_W.

    Returns None when the table supports the train from its start to where it stops.
    """
    s = np.linspace(start, max(last_place(track, train), start), CHECKED_PLACES)
    if track.closed:
        s = np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False)
    x, y, heading = track.pose(s)
    cos, sin = np.cos(turns * heading), np.sin(turns * heading)
    places = [np.column_stack(track.pose(np.array([0.0, track.length]))[:2])]
    ahead, aside = wheels(train)
    for along in (-ahead, ahead):
        for across in (-aside, aside):
            places.append(np.column_stack([x + along * cos - across * sin, y + along * sin + across * cos]))
    points = np.concatenate(places)
    beyond = ((points < TABLE_TOP[0]) | (points > TABLE_TOP[1])).any(axis=1)
    return tuple(points[np.argmax(beyond)].tolist()) if beyond.any() else None


def last_place(track: Track, train: TrainConfig = TrainConfig()) -> float:
    """Returns the arc length [m] at which a train stops on an open track."""
    return track.length - load_of(train.body, train.scale).half_length


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
    s = np.linspace(start, max(last_place(track, scenario.train), start), CHECKED_PLACES)
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
    config = grasp_of(scenario)
    seen = scenario.vision.lag_cycles * VISION_PERIOD + SEEN_FOR
    above = config.approach_duration + config.settle_time
    return seen + above + config.descent_duration - config.closing_lead + touch_delay(config)
