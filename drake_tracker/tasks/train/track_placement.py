"""The track of a run: placed at random by the seed, and checked against the work volume and the reach of the arm."""

import math

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks.train.reach import CHECKED_PLACES, Reach
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.vision.window import footprint
from drake_tracker.world.config import TrackConfig
from drake_tracker.world.tracks import Track, make_track

STREAM = 1
"""The track's stream of random numbers: default_rng([seed, STREAM])."""
MOST_DRAWS = 100
"""Greatest number of random placements of a track that are tried."""
MOST_MISSED = 20
"""Greatest number of placements that are tried and turn out to be beyond the reach of the arm, a slower check."""


def place_track(scenario: TrainScenario, reach: Reach | None = None) -> tuple[Track, float]:
    """Returns the track of a scenario and the arc length at which the train starts.

    Centre and rotation within their ranges, the direction and the start are drawn at random, where the scenario leaves
    them open. A closed track that would leave the work volume or the reach of the arm is placed again.

    Args:
        scenario: the scenario.
        reach: reach of the scenario's arm; None: it is computed.

    Returns (track in the direction of travel, arc length of the start [m]).
    """
    config = scenario.track
    rng = np.random.default_rng([scenario.seed, STREAM])
    offset, turn = rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0)
    backward = rng.uniform() < 0.5 if config.direction == "random" else config.direction == "backward"
    drawn = rng.uniform()
    track = _placed(config, offset, turn)
    if config.kind != "csv" and track.closed:
        track = _fitting(scenario, track, rng, reach or Reach(scenario))
    if backward:
        track = track.reversed()
    fraction = config.start
    if fraction < 0.0:
        fraction = drawn if track.closed else 0.0
    return track, fraction * track.length


def _fitting(scenario: TrainScenario, first: Track, rng: np.random.Generator, reach: Reach) -> Track:
    """Returns the track in the first placement that fits, or in the first placement when none does."""
    track, missed = first, 0
    for _ in range(MOST_DRAWS):
        if place_outside(scenario, track) is None:
            if reach.missed(track) is None:
                return track
            missed += 1
            if missed == MOST_MISSED:
                break
        track = _placed(scenario.track, rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0))
    return first


def _placed(config: TrackConfig, offset: np.ndarray, turn: float) -> Track:
    """Returns the track of a scenario's ``track`` in a place given by shares (-1 to 1) of its ranges."""
    return make_track(
        config.kind,
        semi_axes=config.semi_axes,
        radius=config.radius,
        straight=config.straight,
        length=config.length,
        csv=config.csv,
        centre=np.asarray(config.centre) + offset * config.centre_range,
        rotation=math.radians(config.rotation_deg + turn * config.rotation_range_deg),
    )


def place_outside(scenario: TrainScenario, track: Track) -> tuple[float, float] | None:
    """Returns a place (x, y) in W at which a track is outside the work volume [m], or None.

    Args:
        scenario: the scenario with the work volume.
        track: the track.
    """
    outline = footprint(scenario.vision.work_volume, scenario.vision.outline).astype(np.float32)
    for s in np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False):
        x, y, _ = track.pose(s)
        if cv2.pointPolygonTest(outline, (float(x), float(y)), False) < 0:
            return float(x), float(y)
    return None


def check_track(scenario: TrainScenario, track: Track, reach: Reach) -> None:
    """Checks that a closed track is inside the work volume and within reach.

    An open track passes the arm and may begin and end where the arm cannot follow. It is not checked.

    Args:
        scenario: the scenario.
        track: its track, as placed.
        reach: reach of its arm.

    Raises DrakeTrackerError when a place is outside the work volume or out of reach.
    """
    if not track.closed:
        return
    (x_low, y_low, _), (x_high, y_high, _) = scenario.vision.work_volume
    volume = f"{scenario.vision.outline} of x {x_low:g} to {x_high:g}, y {y_low:g} to {y_high:g} (vision.work_volume)"
    what = scenario.where("track.csv" if scenario.track.kind == "csv" else "track.kind")
    outside = place_outside(scenario, track)
    if outside is not None:
        x, y = outside
        raise DrakeTrackerError(
            f"{what} = {scenario.track.kind}: the track passes ({x:.3f}, {y:.3f}) m, outside the {volume}"
        )
    missed = reach.missed(track)
    if missed is not None:
        x, y, height = missed
        raise DrakeTrackerError(
            f"{what} = {scenario.track.kind}: the track is out of the arm's reach at ({x:.3f}, {y:.3f}) m, "
            f"{height:.2f} m above the train; move or shrink it"
        )
