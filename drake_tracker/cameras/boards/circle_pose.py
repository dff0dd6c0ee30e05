"""The pose of a board relative to a camera, from the images of circles on it: four coplanar points (section 3).

Nashman and Chaconas 1990 cite another paper for the algorithm. Here it is the closed form for planes (infinitesimal
plane-based pose estimation, both of whose solutions are considered) with a Levenberg-Marquardt refinement.
"""

import itertools
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.errors import DrakeTrackerError

MAX_RMS = 0.35
"""Reprojection error [px] above which the circles do not belong to the board."""
MIN_LEAD = 3.0
"""The best order of the circles must fit better than the next best by this factor."""
MAX_CIRCLES = 20
"""Only the first so many of the circles are considered: that makes 4845 choices of four."""
_RIGID = 0.1
"""Approximate largest relative error of a homography's lengths and right angle."""
_AREA = 0.4
"""Largest difference between a circle's area and the expected one, as a logarithm."""
_ROUNDS = 3
_NEIGHBOURHOOD = 6.0
"""Factor by which the rectangle around the board's circles is enlarged where larger circles are searched for."""


class BoardPose(NamedTuple):
    """The pose of a board relative to the camera.

    Attributes:
        X_CB: (4, 4), takes p_BQ to p_CQ [m].
        rms: reprojection error of the circles' centres [px].
    """

    X_CB: np.ndarray
    rms: float


def locate_board(
    circles: ArrayLike, p_BQ: ArrayLike, K: ArrayLike, distortion: ArrayLike | None = None, *, radius: float = 0.0
) -> BoardPose:
    """Returns the `BoardPose` of a board that faces the camera.

    Args:
        circles: (m, 2) [px], centroids of the circles' images in any order, or (m, 3) with their areas [px], as
            `CircleMeasurement`s. There may be more than the board has: the choice that fits best is used. With areas,
            at most one of the others may be larger: four of many pegs can be in the right places by chance when a
            circle is hidden.
        p_BQ: (4, 3) [m], centres of the circles on the board, z = 0, at the corners of a convex quadrangle without
            rotational symmetry: otherwise their order is ambiguous.
        K: (3, 3) intrinsic matrix [px].
        distortion: (5,) coefficients in OpenCV's order; None is a lens without distortion.
        radius: of the circles [m]. The centre of a circle's image is slightly off the image of its centre, the more
            the larger the circle; 0 ignores this, and the areas.

    Raises DrakeTrackerError when no order fits, or more than one does.
    """
    circles = np.array(circles, dtype=float)
    p_BQ, K = np.asarray(p_BQ, dtype=float), np.asarray(K, dtype=float)
    distortion = np.zeros(5) if distortion is None else np.asarray(distortion, dtype=float)
    if p_BQ.shape != (4, 3) or len(circles) < 4:
        raise DrakeTrackerError(f"{len(circles)} circles were seen and {len(p_BQ)} are on the board; it takes 4")
    # Distortion is removed here: from now on the image of a conic is a conic.
    circles[:, :2] = cv2.undistortPoints(circles[:, np.newaxis, :2], K, distortion, P=K)[:, 0]
    orders = _cyclic_orders(circles[:MAX_CIRCLES], p_BQ)
    orders = orders[_possible(circles[orders], p_BQ, K, radius)]
    poses = [_best_pose(circles[order, :2], p_BQ, K, radius) for order in orders]
    fits = [
        pose
        for pose, order in zip(poses, orders)
        if pose is not None and not _misses_circles(pose.X_CB, np.delete(circles, order, axis=0), p_BQ, K, radius)
    ]
    fits.sort(key=lambda fit: fit.rms)
    if not fits or fits[0].rms > MAX_RMS:
        found = f"the best order leaves {fits[0].rms:.1f} px" if fits else "no order of them is possible"
        raise DrakeTrackerError(
            f"the circles found are not those of the board: {found}; one may be hidden, and something else mistaken "
            "for it"
        )
    if len(fits) > 1 and fits[1].rms < MIN_LEAD * fits[0].rms:
        raise DrakeTrackerError(
            f"two orders of the circles fit, with {fits[0].rms:.2f} and {fits[1].rms:.2f} px; take sharper images or "
            "place the circles farther out of square"
        )
    return fits[0]


def image_centres(X_CB: np.ndarray, p_BQ: ArrayLike, K: np.ndarray, radius: float) -> np.ndarray:
    """Returns the centres (n, 2) [px] of the images of circles around p_BQ on the plane z_B = 0.

    The image of a circle is an ellipse. Its centre is the pole of the line at infinity: the last column of its dual
    conic, which a homography H maps from the circle's C* to H C* H^T.

    Args:
        X_CB: (4, 4), takes p_BQ to p_CQ [m].
        p_BQ: centres of the circles, shape (n, 3) [m].
        K: (3, 3) intrinsic matrix [px].
        radius: of the circles [m]; 0 gives the images of their centres.
    """
    p_BQ = np.asarray(p_BQ)
    H = K @ np.column_stack([X_CB[:3, 0], X_CB[:3, 1], X_CB[:3, 3]])
    centres = np.empty((len(p_BQ), 2))
    for row, (x, y, _) in zip(centres, p_BQ):
        dual = np.diag([radius**2, radius**2, 0.0]) - np.outer([x, y, 1.0], [x, y, 1.0])
        image = H @ dual @ H.T
        row[:] = image[:2, 2] / image[2, 2]
    return centres


def _cyclic_orders(circles: np.ndarray, p_BQ: np.ndarray) -> np.ndarray:
    """Returns every choice of four circles, in every order in which they could be the board's: indices (m, 4).

    Seen from the front, the sense of rotation about the board's centre is reversed in the image, whose v runs down.
    """
    choices = np.array(list(itertools.combinations(range(len(circles)), 4)))
    image = np.take_along_axis(choices, np.argsort(-_angles(circles[choices]), axis=1), axis=1)
    orders = np.empty((4, *choices.shape), int)
    for turn in range(4):
        orders[turn][:, np.argsort(_angles(p_BQ))] = np.roll(image, turn, axis=1)
    return orders.reshape(-1, 4)


def _angles(points: np.ndarray) -> np.ndarray:
    """Returns the angles (..., n) [rad] of points (..., n, 2 or more) about their mean."""
    points = points[..., :2] - points[..., :2].mean(axis=-2, keepdims=True)
    return np.arctan2(points[..., 1], points[..., 0])


def _possible(circles: np.ndarray, p_BQ: np.ndarray, K: np.ndarray, radius: float) -> np.ndarray:
    """Returns for each ordered set of four circles (m, 4, 2 or 3) whether it may be the image of the circles of the
    board, booleans (m,).

    The homography from the board must describe a rigid plane: two columns of K^-1 H have equal length and are
    perpendicular, and the areas agree with the mapped circles. All this holds approximately.
    """
    H = _projective_basis(circles) @ np.linalg.inv(_projective_basis(p_BQ[np.newaxis]))
    a, b = np.moveaxis(np.linalg.inv(K) @ H, 2, 0)[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        possible = np.abs(np.log(lengths[0] / lengths[1])) < _RIGID
        possible &= np.abs((a * b).sum(axis=1)) < _RIGID * lengths[0] * lengths[1]
        if radius > 0.0 and circles.shape[2] == 3:
            depth = p_BQ[:, :2] @ H[:, 2, :2, np.newaxis] + H[:, 2, 2, np.newaxis, np.newaxis]
            areas = np.pi * radius**2 * np.abs(np.linalg.det(H)[:, np.newaxis] / depth[..., 0] ** 3)
            possible &= (np.abs(np.log(circles[..., 2] / areas)) < _AREA).all(axis=1)
    return possible


def _projective_basis(points: np.ndarray) -> np.ndarray:
    """Returns matrices (m, 3, 3) that take the three axes and (1, 1, 1) to four points (m, 4, 2 or more)."""
    q = np.concatenate([points[..., :2], np.ones((*points.shape[:2], 1))], axis=2)

    def determinant(i: int, j: int, k: int) -> np.ndarray:
        return (q[:, i] * np.cross(q[:, j], q[:, k])).sum(axis=1)

    weights = np.stack([determinant(3, 1, 2), determinant(0, 3, 2), determinant(0, 1, 3)], axis=1)
    return (q[:, :3] * weights[..., np.newaxis]).swapaxes(1, 2)


def _best_pose(uv: np.ndarray, p_BQ: np.ndarray, K: np.ndarray, radius: float) -> BoardPose | None:
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


def _misses_circles(X_CB: np.ndarray, others: np.ndarray, p_BQ: np.ndarray, K: np.ndarray, radius: float) -> bool:
    """Returns whether two other circles on or near the board are larger than circles of the board would be at these
    places.

    These are the circles of the board, and the fit is to smaller things. One larger thing is allowed: the cup.

    Args:
        X_CB: (4, 4), a pose that fits four of the circles.
        others: the circles that it leaves, shape (m, 2 or 3) [px]; without areas the answer is False.
        p_BQ: centres of the circles on the board, shape (4, 3) [m].
        K: (3, 3) intrinsic matrix [px].
        radius: of the circles [m]; with 0 the answer is False.
    """
    if radius <= 0.0 or others.shape[1] < 3:
        return False
    H = K @ np.column_stack([X_CB[:3, 0], X_CB[:3, 1], X_CB[:3, 3]])
    x, y, scale = np.linalg.solve(H, np.column_stack([others[:, :2], np.ones(len(others))]).T)
    middle = 0.5 * (p_BQ[:, :2].max(axis=0) + p_BQ[:, :2].min(axis=0))
    reach = _NEIGHBOURHOOD * (p_BQ[:, :2].max(axis=0) - middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        near = (scale > 0.0) & (np.abs(np.column_stack([x, y]) / scale[:, np.newaxis] - middle) < reach).all(axis=1)
    expected = np.pi * radius**2 * np.abs(np.linalg.det(H)) * np.abs(scale) ** 3
    return int(np.count_nonzero(near & (others[:, 2] > np.exp(_AREA) * expected))) > 1


def _matrix(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = cv2.Rodrigues(rotation)[0]
    X[:3, 3] = np.ravel(translation)
    return X
