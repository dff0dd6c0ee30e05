"""Where a board is before a camera, from the images of circles on it: four coplanar points (section 3).

Nashman and Chaconas 1990 cite another paper for the algorithm. Here it is the closed form for planes (infinitesimal
plane-based pose, whose two solutions are both considered) with Levenberg and Marquardt's refinement.
"""

import itertools
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.errors import DrakeTrackerError

MAX_RMS = 0.35
"""Reprojection error [px] above which the circles are not those of the board."""
MOST_TRIED = 9
"""Of things that may be circles, the largest that are tried."""
SAME_AREA = 1.6
"""A circle's area agrees with the pose when it is within this factor of what the pose makes of it."""
MIN_LEAD = 3.0
"""The best order of the circles must fit this many times better than the next."""
_ROUNDS = 3


class BoardPose(NamedTuple):
    """X_CB (4, 4), which takes p_BQ to p_CQ [m], and the reprojection error of the circles' centres [px rms]."""

    X_CB: np.ndarray
    rms: float


def locate_board(uv, p_BQ, K, distortion=None, *, radius=0.0):
    """Returns the `BoardPose` of a board whose face looks towards the camera.

    Args:
        uv: (n, 2) [px], centroids of the circles' images, n at least 4, in any order.
        p_BQ: (n, 3) [m], centres of the circles on the board, z = 0. The order is found by trying; turned by a half or
            a quarter turn the centres must not look like themselves, else it cannot be told.
        K: (3, 3) intrinsic matrix [px]. distortion: (5,) coefficients in OpenCV's order, none by default.
        radius: of the circles [m]. The middle of a circle's image lies a little off the image of its centre, farther
            the larger the circle; 0 leaves that alone.

    Raises DrakeTrackerError when no order fits, or more than one does.
    """
    uv, p_BQ, K = np.asarray(uv, dtype=float), np.asarray(p_BQ, dtype=float), np.asarray(K, dtype=float)
    distortion = np.zeros(5) if distortion is None else np.asarray(distortion, dtype=float)
    if uv.shape != (len(p_BQ), 2) or p_BQ.shape != (len(p_BQ), 3) or len(p_BQ) < 4:
        raise DrakeTrackerError(f"{len(uv)} circles were seen and {len(p_BQ)} are on the board; at least 4 must agree")
    # Without distortion from here on: a conic's image is a conic.
    uv = cv2.undistortPoints(uv[:, np.newaxis], K, distortion, P=K)[:, 0]
    fits = []
    for order in _cyclic_orders(uv, p_BQ):
        fit = _best_pose(uv[order], p_BQ, K, radius)
        if fit is not None:
            fits.append(fit)
    fits.sort(key=lambda fit: fit.rms)
    if not fits or fits[0].rms > MAX_RMS:
        found = f"the best order leaves {fits[0].rms:.1f} px" if fits else "they would be seen from behind"
        raise DrakeTrackerError(
            f"the circles found are not those of the board: {found}; one may be hidden and another thing taken for it"
        )
    if len(fits) > 1 and fits[1].rms < MIN_LEAD * fits[0].rms:
        raise DrakeTrackerError(
            f"two orders of the circles fit, with {fits[0].rms:.2f} and {fits[1].rms:.2f} px; take sharper images or "
            "place the circles farther out of square"
        )
    return fits[0]


def find_board(readings, p_BQ, K, distortion=None, *, radius):
    """Returns (`BoardPose`, readings of its circles) from all that may be a circle, pegs and shadows among them.

    The circles are those whose places and areas fit one pose of the board best; the other arguments are `locate_board`'s.
    Raises DrakeTrackerError when none do.
    """
    readings = sorted(readings, key=lambda reading: -reading.area)[:MOST_TRIED]
    best = None
    for group in itertools.combinations(readings, len(p_BQ)):
        uv = np.array([[reading.u, reading.v] for reading in group])
        try:
            pose = locate_board(uv, p_BQ, K, distortion, radius=radius)
        except DrakeTrackerError:
            continue
        expected = image_areas(pose.X_CB, p_BQ, K, radius)
        ratios = np.sort([reading.area for reading in group]) / np.sort(expected)
        fits = np.all((ratios < SAME_AREA) & (ratios > 1.0 / SAME_AREA))
        if fits and (best is None or pose.rms < best[0].rms):
            best = pose, group
    if best is None:
        raise DrakeTrackerError(
            f"of {len(readings)} dark spots no {len(p_BQ)} lie like the board's circles; one may be hidden or out of view: "
            "clear the view, or move the camera until it sees the whole board"
        )
    return best


def image_areas(X_CB, p_BQ, K, radius):
    """Returns the areas (n,) [px^2] of the images of circles about p_BQ (n, 3) [m] on the plane z_B = 0."""
    angle = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    rim = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    p_CQ = (np.asarray(p_BQ)[:, np.newaxis] + rim) @ X_CB[:3, :3].T + X_CB[:3, 3]
    uvw = p_CQ @ K.T
    u, v = uvw[..., 0] / uvw[..., 2], uvw[..., 1] / uvw[..., 2]
    return 0.5 * np.abs(np.sum(u * np.roll(v, -1, axis=1) - v * np.roll(u, -1, axis=1), axis=1))


def image_centres(X_CB, p_BQ, K, radius):
    """Returns the middles (n, 2) [px] of the images of circles about p_BQ (n, 3) [m] on the plane z_B = 0.

    The image of a circle is an ellipse. Its middle is the pole of the line at infinity: the last column of its dual
    conic, which a homography H takes from the circle's C* to H C* H^T.
    """
    H = K @ np.column_stack([X_CB[:3, 0], X_CB[:3, 1], X_CB[:3, 3]])
    centres = np.empty((len(p_BQ), 2))
    for row, (x, y, _) in zip(centres, p_BQ):
        dual = np.diag([radius**2, radius**2, 0.0]) - np.outer([x, y, 1.0], [x, y, 1.0])
        image = H @ dual @ H.T
        row[:] = image[:2, 2] / image[2, 2]
    return centres


def _cyclic_orders(uv, p_BQ):
    """Yields index arrays that put the pixels into the order of the board's points, for every way round it could lie.

    Seen from the front, points go round the board's middle the other way in the image, whose v runs down.
    """
    image = np.argsort(_angles(uv))[::-1]
    board = np.argsort(_angles(p_BQ))
    for turn in range(len(uv)):
        order = np.empty(len(uv), int)
        order[board] = np.roll(image, turn)
        yield order


def _angles(points):
    points = points[:, :2] - points[:, :2].mean(axis=0)
    return np.arctan2(points[:, 1], points[:, 0])


def _best_pose(uv, p_BQ, K, radius):
    """Returns the `BoardPose` for one order of the circles, or None when the board would be seen from behind."""
    fits = []
    _, rotations, translations, _ = cv2.solvePnPGeneric(p_BQ, uv, K, np.zeros(5), flags=cv2.SOLVEPNP_IPPE)
    for rotation, translation in zip(rotations, translations):
        if not (np.isfinite(rotation).all() and np.isfinite(translation).all()):
            continue
        centres = uv
        for _ in range(_ROUNDS if radius > 0.0 else 1):
            rotation, translation = cv2.solvePnPRefineLM(p_BQ, centres, K, np.zeros(5), rotation, translation)
            X_CB = _matrix(rotation, translation)
            offset = image_centres(X_CB, p_BQ, K, radius) - image_centres(X_CB, p_BQ, K, 0.0)
            centres = uv - offset
        faces = X_CB[:3, 2] @ X_CB[:3, 3] < 0.0 < X_CB[2, 3]
        if faces and np.isfinite(X_CB).all():
            miss = image_centres(X_CB, p_BQ, K, radius) - uv
            fits.append(BoardPose(X_CB, float(np.sqrt((miss**2).sum(axis=1).mean()))))
    return min(fits, key=lambda fit: fit.rms, default=None)


def _matrix(rotation, translation):
    X = np.eye(4)
    X[:3, :3] = cv2.Rodrigues(rotation)[0]
    X[:3, 3] = np.ravel(translation)
    return X
