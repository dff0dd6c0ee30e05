"""What a healthy estimator would have made of a run's points: the yardstick of the autopsy.

An error early in the chain grows on its way: noise of a centroid ends as a wrong speed, which ends as a wrong place two
thirds of a second ahead. To tell whose error it was, the points of the log are filtered anew, by the default estimator:
once as they were, once as they would have been with cameras calibrated perfectly, and once as the train truly drove.
What changes in its prediction from one to the other is what the stage between them did.
"""

import numpy as np

from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, pack_prediction
from drake_tracker.estimation import make_estimator
from drake_tracker.tasks.episode import train_pose
from drake_tracker.vision.triangulation import triangulate

YARDSTICK = "closed_path"
"""The default estimator."""
_SAME_STAMP = 1e-6


def point_rows(log):
    """Returns (stamps (n,) [s], points (n, 3) [m, W]) of the valid points of a run, each once."""
    point = log["point"]
    stamps = point["stamp"]
    new = (point["valid"] > 0) & (np.diff(stamps, prepend=-1.0) > _SAME_STAMP)
    return stamps[new], point.view("x", "y", "z")[new]


def seen_by(cameras, log, stamps, points):
    """Returns where cameras that are known exactly would have seen the centroids of these stamps, shape (n, 3) [m, W].

    ``cameras``: (left, right) `CameraModel`s. Without centroids in the log, or where their rays do not meet, it is the
    point as it was.
    """
    seen = np.array(points)
    if "centroid_left" not in log:
        return seen
    pixels = [_pixels(log[f"centroid_{side}"], stamps) for side in ("left", "right")]
    for row in np.nonzero(~np.isnan(pixels[0] + pixels[1]).any(axis=1))[0]:
        meeting = triangulate(*cameras, pixels[0][row], pixels[1][row])
        if meeting is not None:
            seen[row] = meeting.p_WQ
    return seen


def true_points(log, stamps):
    """Returns where the train truly was at these stamps, shape (n, 3) [m, W]."""
    return train_pose(log, stamps)[:, :3]


def replay(stamps, points, wanted):
    """Returns {stamp: packet} of what the yardstick predicts on ``points`` (n, 3) [m, W], right after the point of each
    stamp [s] in ``wanted``; stamps at which it is not ready are left out.
    """
    estimator = make_estimator(YARDSTICK)
    state = estimator.initial_state()
    wanted = {round(stamp, 6) for stamp in wanted}
    packets = {}
    for stamp, point in zip(stamps, points):
        state = estimator.update(state, stamp, point)
        key = round(float(stamp), 6)
        if key in wanted and estimator.ready(state):
            times = state.stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([estimator.predict(state, times), np.zeros(KNOT_COUNT)])
            packets[key] = pack_prediction(state.stamp, 0, knots)
    return packets


def _pixels(centroid, stamps):
    """Returns the pixels (n, 2) of the valid centroids of these stamps, NaN where there is none."""
    valid = centroid["valid"] > 0
    known, uv = centroid["stamp"][valid], centroid.view("u", "v")[valid]
    if len(known) == 0:
        return np.full((len(stamps), 2), np.nan)
    nearest = np.clip(np.searchsorted(known, stamps - _SAME_STAMP), 0, len(known) - 1)
    found = np.array(uv[nearest])
    found[np.abs(known[nearest] - stamps) > _SAME_STAMP] = np.nan
    return found
