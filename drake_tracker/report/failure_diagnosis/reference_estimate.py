"""The predictions of a healthy estimator from a run's points: the reference of the autopsy.

An error grows along the chain: noise of a centroid becomes a wrong speed, which becomes a wrong position two thirds of
a second ahead. To find the stage that caused it, the estimator that learns the closed path filters the points of the
log again: as they were, as they would have been with perfectly calibrated cameras, and on the true path of the train.
The difference between two of its predictions is the contribution of the stage between them.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.constants import SIDES
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, pack_prediction
from drake_tracker.estimation.estimator import make_estimator
from drake_tracker.tasks.train.episode import train_pose

YARDSTICK = "closed_path"
"""The estimator that learns the closed path, whatever the estimator of the run."""
_SAME_STAMP = 1e-6


def point_rows(log: Mapping[str, Signal]) -> tuple[np.ndarray, np.ndarray]:
    """Returns (stamps (n,) [s], points (n, 3) [m, W]) of the valid points of a run, each once."""
    point = log["point"]
    stamps = point["stamp"]
    new = (point["valid"] > 0) & (np.diff(stamps, prepend=-1.0) > _SAME_STAMP)
    return stamps[new], point.view("x", "y", "z")[new]


def seen_by(
    cameras: tuple[CameraModel, CameraModel], log: Mapping[str, Signal], stamps: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Returns the points that exactly known cameras triangulate from the centroids of these stamps, (n, 3) [m, W].

    Where the log has no centroids, or their rays do not meet, a point stays as it was. So does that of an object whose
    silhouette is merged with another one: the tracker of several objects finds it without rays, and its gap is 0.

    Args:
        cameras: exact models of the left and the right camera.
        log: {name: Signal}.
        stamps: shape (n,) [s].
        points: of the run, shape (n, 3) [m, W].
    """
    seen = np.array(points)
    if "centroid_left" not in log:
        return seen
    left, right = (_at(log[f"centroid_{side}"], ("u", "v"), stamps) for side in SIDES)
    known = ~np.isnan(left + right).any(axis=1)
    if "tracks" in log:
        known &= _at(log["point"], ("gap",), stamps)[:, 0] > 0.0
    for row in np.nonzero(known)[0]:
        meeting = triangulate(*cameras, left[row], right[row])
        if meeting is not None:
            seen[row] = meeting.p_WQ
    return seen


def true_points(log: Mapping[str, Signal], stamps: np.ndarray) -> np.ndarray:
    """Returns the true position of the train at these stamps, shape (n, 3) [m, W]."""
    return train_pose(log, stamps)[:, :3]


def refilter(stamps: np.ndarray, points: np.ndarray, wanted: Iterable[float]) -> dict[float, np.ndarray]:
    """Returns {stamp: `Prediction` vector} that the yardstick predicts from points.

    Stamps at which it is not ready are omitted. The keys are rounded to a microsecond.

    Args:
        stamps: of the points, shape (n,) [s].
        points: shape (n, 3) [m, W].
        wanted: stamps [s] right after whose point a prediction is wanted.
    """
    estimator = make_estimator(YARDSTICK)
    state = estimator.initial_state()
    keys = {round(stamp, 6) for stamp in wanted}
    packets = {}
    for stamp, point in zip(stamps, points):
        state = estimator.update(state, stamp, point)
        key = round(float(stamp), 6)
        if key in keys and estimator.ready(state):
            times = state.stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([estimator.predict(state, times), np.zeros(KNOT_COUNT)])
            packets[key] = pack_prediction(state.stamp, 0, knots)
    return packets


def _at(signal: Signal, names: Sequence[str], stamps: np.ndarray) -> np.ndarray:
    """Returns some fields of the valid samples of these stamps, shape (n, len(names)), NaN where there is none."""
    valid = signal["valid"] > 0
    known, values = signal["stamp"][valid], signal.view(*names)[valid]
    if len(known) == 0:
        return np.full((len(stamps), len(names)), np.nan)
    nearest = np.clip(np.searchsorted(known, stamps - _SAME_STAMP), 0, len(known) - 1)
    found = np.array(values[nearest])
    found[np.abs(known[nearest] - stamps) > _SAME_STAMP] = np.nan
    return found
