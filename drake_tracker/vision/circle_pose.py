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
MIN_LEAD = 3.0
"""The best order of the circles must fit this many times better than the next."""
MAX_CIRCLES = 20
"""So many of the circles handed in are looked at, from the first: there are 4845 choices of four."""
_RIGID = 0.1
"""Roughly the greatest error of a homography's lengths and right angle, as shares."""
_AREA = 0.5
"""Greatest difference of a circle's area from the expected one, as a logarithm."""
_ROUNDS = 3


class BoardPose(NamedTuple):
    """X_CB (4, 4), which takes p_BQ to p_CQ [m], and the reprojection error of the circles' centres [px rms]."""

    X_CB: np.ndarray
    rms: float


def locate_board(circles, p_BQ, K, distortion=None, *, radius=0.0):
    """Returns the `BoardPose` of a board whose face looks towards the camera.

    Args:
        circles: (m, 2) [px], centroids of the circles' images in any order, or (m, 3) with their areas [px], as
            `CircleReading`s. There may be more than the board has: of all choices the one that fits best is taken.
        p_BQ: (n, 3) [m], centres of the circles on the board, n at least 4, z = 0, at the corners of a convex polygon
            that does not look like itself when it is turned, else the order cannot be told.
        K: (3, 3) intrinsic matrix [px]. distortion: (5,) coefficients in OpenCV's order, none by default.
        radius: of the circles [m]. The middle of a circle's image lies a little off the image of its centre, farther
            the larger the circle; 0 leaves that, and the areas, alone.

    Raises DrakeTrackerError when no order fits, or more than one does.
    """
    circles, p_BQ, K = np.array(circles, dtype=float), np.asarray(p_BQ, dtype=float), np.asarray(K, dtype=float)
    distortion = np.zeros(5) if distortion is None else np.asarray(distortion, dtype=float)
    if len(p_BQ) < 4 or len(circles) < len(p_BQ):
        raise DrakeTrackerError(f"{len(circles)} circles were seen and {len(p_BQ)} are on the board; show at least 4")
    # Without distortion from here on: a conic's image is a conic.
    circles[:, :2] = cv2.undistortPoints(circles[:, np.newaxis, :2], K, distortion, P=K)[:, 0]
    fits = []
    for chosen in itertools.combinations(circles[:MAX_CIRCLES], len(p_BQ)):
        chosen = np.array(chosen)
        for order in _cyclic_orders(chosen, p_BQ):
            if _is_possible(chosen[order], p_BQ, K, radius):
                fit = _best_pose(chosen[order, :2], p_BQ, K, radius)
                if fit is not None:
                    fits.append(fit)
    fits.sort(key=lambda fit: fit.rms)
    if not fits or fits[0].rms > MAX_RMS:
        found = f"the best order leaves {fits[0].rms:.1f} px" if fits else "no order of them can be"
        raise DrakeTrackerError(
            f"the circles found are not those of the board: {found}; one may be hidden and another thing taken for it"
        )
    if len(fits) > 1 and fits[1].rms < MIN_LEAD * fits[0].rms:
        raise DrakeTrackerError(
            f"two orders of the circles fit, with {fits[0].rms:.2f} and {fits[1].rms:.2f} px; take sharper images or "
            "place the circles farther out of square"
        )
    return fits[0]


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


def _is_possible(circles, p_BQ, K, radius):
    """Tells roughly, and fast, whether circles (n, 2 or 3) can be images of those on the board, in this order.

    The homography from the board must be that of a rigid plane, two columns of K^-1 H of one length and at right
    angles, and the areas must be what it makes of the circles'.
    """
    H, _ = cv2.findHomography(p_BQ[:, :2], circles[:, :2])
    if H is None:
        return False
    a, b, _ = np.linalg.solve(K, H).T
    lengths = np.linalg.norm(a), np.linalg.norm(b)
    if abs(np.log(lengths[0] / lengths[1])) > _RIGID or abs(a @ b) > _RIGID * lengths[0] * lengths[1]:
        return False
    if radius == 0.0 or circles.shape[1] < 3:
        return True
    depth = p_BQ[:, :2] @ H[2, :2] + H[2, 2]
    areas = np.pi * radius**2 * np.abs(np.linalg.det(H) / depth**3)
    return bool((np.abs(np.log(circles[:, 2] / areas)) < _AREA).all())


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
