"""The track of a run: drawn from the seed, and checked against what the arm can reach and the cameras can see."""

import math

import cv2
import numpy as np

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.differential_ik import make_parameters, step_joints
from drake_tracker.errors import DrakeTrackerError
from drake_tracker.vision.window import footprint
from drake_tracker.world.plant import TRAIN_HEIGHT
from drake_tracker.world.tracks import make_track

STREAM = 1
"""Number of this stream of random draws under a scenario's seed."""
MOST_DRAWS = 100
"""Places in which a track is tried to be put before it is said that it does not fit."""
CHECKED_PLACES = 40
"""Places along a track that are tried for reach."""


def draw_track(scenario):
    """Returns (track, start): the track of a scenario in the direction of travel, and the arc length [m] of the start.

    The seed draws, each only where the scenario leaves it open, the centre and the rotation within their ranges, the
    direction and the start. A place in which a closed track would leave the work volume is drawn again.
    """
    config = scenario.track
    rng = np.random.default_rng([scenario.seed, STREAM])
    offset, turn = rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0)
    backward = rng.uniform() < 0.5 if config.direction == "random" else config.direction == "backward"
    drawn = rng.uniform()
    first = track = _placed(config, offset, turn)
    for _ in range(MOST_DRAWS):
        if config.kind == "csv" or not track.closed or place_outside(scenario, track) is None:
            break
        track = _placed(config, rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0))
    else:
        track = first  # it fits nowhere, and `check_track` will say so
    if backward:
        track = track.reversed()
    fraction = config.start
    if fraction < 0.0:
        fraction = drawn if track.closed else 0.0
    return track, fraction * track.length


def _placed(config, offset, turn):
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


def place_outside(scenario, track):
    """Returns a place (x, y) [m] at which a track leaves the work volume, or None."""
    outline = footprint(scenario.vision.work_volume, scenario.vision.outline).astype(np.float32)
    for s in np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False):
        x, y, _ = track.pose(s)
        if cv2.pointPolygonTest(outline, (float(x), float(y)), False) < 0:
            return float(x), float(y)
    return None


def check_track(scenario, track, model, q_initial):
    """Raises DrakeTrackerError, in one line, when a closed track leaves the work volume or the arm's reach.

    An open track runs past the arm and may begin and end where the arm cannot follow.
    """
    if not track.closed:
        return
    (x_low, y_low, _), (x_high, y_high, _) = scenario.vision.work_volume
    volume = f"{scenario.vision.outline} of x {x_low:g} to {x_high:g}, y {y_low:g} to {y_high:g} (vision.work_volume)"
    parameters = make_parameters(model, 0.1)
    q = np.array(q_initial)
    what = scenario.where("track.csv" if scenario.track.kind == "csv" else "track.kind")
    outside = place_outside(scenario, track)
    if outside is not None:
        x, y = outside
        raise DrakeTrackerError(
            f"{what} = {scenario.track.kind}: the track comes to ({x:.3f}, {y:.3f}) m, outside the {volume}"
        )
    for s in np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False):
        x, y, _ = track.pose(s)
        z = scenario.table_height + TRAIN_HEIGHT
        for height in (scenario.grasp.hover_height, scenario.grasp.grasp_height):
            X_WT = tool_down((x, y, z + height), np.pi / 2)
            for _ in range(20):
                q, _ = step_joints(model, parameters, q, X_WT)
                error = np.linalg.norm(model.tool_pose(q).translation() - X_WT.translation())
                if error < 1e-3:
                    break
            else:
                raise DrakeTrackerError(
                    f"{what} = {scenario.track.kind}: the track is out of the arm's reach at ({x:.3f}, {y:.3f}) m, "
                    f"{height:.2f} m above the train; move or shrink it"
                )
