"""The common part of the calibration files of other tools: matrices, lenses, and the pose of the second camera.

A camera from such a file is described by an entry, a mapping with the same keys as in a calibration file of this
package: width and height [px], both `UNKNOWN_SIZE` where the file does not say, K, distortion, lens and X_CW.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.cameras.lens_models import FISHEYE, PINHOLE
from drake_tracker.core.errors import DrakeTrackerError

UNKNOWN_SIZE = 0
"""Width and height of a camera whose file does not contain them."""
_LOOSEST = 1e-3
"""Largest deviation from a rotation that is due to rounding; ROS's calibrator writes six decimals."""

Entry = dict[str, Any]


def matrix(path: str, key: str, value: Any, *shapes: tuple[int, ...]) -> np.ndarray:
    """Returns a matrix of a file: a mapping with rows, cols and data, or plain lists of numbers.

    Args:
        path: of the file, for messages.
        key: of the matrix, for messages.
        value: what the file contains.
        *shapes: that the matrix may have; a vector may also be written as a row or a column. None allows any.

    Raises DrakeTrackerError when it is not such a matrix, or not finite.
    """
    try:
        if isinstance(value, dict):
            numbers = np.array(value["data"], dtype=float)
            numbers = numbers.reshape(int(value["rows"]), int(value["cols"]))
        else:
            numbers = np.array(value, dtype=float)
    except (TypeError, ValueError, KeyError, OverflowError):
        numbers = np.empty(0)
    for shape in shapes or [(numbers.size,)]:
        fits = len(shape) == 1 or numbers.shape == shape or numbers.ndim == 1
        if fits and numbers.size and numbers.size == np.prod(shape) and np.isfinite(numbers).all():
            return numbers.reshape(shape)
    wanted = " or ".join(" x ".join(map(str, shape)) for shape in shapes) or "only"
    raise DrakeTrackerError(f"{path}: {key} must contain {wanted} finite numbers")


def pinhole_entry(path: str, key: str, size: Sequence[int], K: np.ndarray, distortion: np.ndarray) -> Entry:
    """Returns the entry of a pinhole with OpenCV's 4, 5, 8, 12 or 14 coefficients.

    Args:
        path: of the file, for messages.
        key: of the coefficients, for messages.
        size: width and height [px].
        K: (3, 3) intrinsic matrix [px].
        distortion: coefficients; those beyond the eighth must be zero.

    Raises DrakeTrackerError on another number of coefficients, a thin prism, or a tilted sensor.
    """
    if len(distortion) not in (4, 5, 8, 12, 14):
        raise DrakeTrackerError(f"{path}: {key} has {len(distortion)} coefficients; a pinhole has 4, 5, 8, 12 or 14")
    if distortion[8:].any():
        raise DrakeTrackerError(f"{path}: {key} has terms of a thin prism or a tilted sensor; they are not supported")
    padded = np.concatenate([distortion, np.zeros(8)])[:8]
    used = padded if padded[5:].any() else padded[:5]
    return {"width": size[0], "height": size[1], "lens": PINHOLE, "K": K, "distortion": used, "X_CW": np.eye(4)}


def fisheye_entry(path: str, key: str, size: Sequence[int], K: np.ndarray, distortion: np.ndarray) -> Entry:
    """Returns the entry of a fisheye. Arguments as for `pinhole_entry`.

    Raises DrakeTrackerError on another number of coefficients than four.
    """
    if len(distortion) != 4:
        raise DrakeTrackerError(f"{path}: {key} has {len(distortion)} coefficients; a fisheye has 4")
    return {"width": size[0], "height": size[1], "lens": FISHEYE, "K": K, "distortion": distortion, "X_CW": np.eye(4)}


def pose(path: str, key: str, R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns the matrix (4, 4) of a rotation, which may be rounded, and a position.

    Raises DrakeTrackerError when R is not a rotation.
    """
    u, s, vt = np.linalg.svd(R)
    if np.abs(s - 1.0).max() > _LOOSEST or np.linalg.det(R) < 0.0:
        raise DrakeTrackerError(f"{path}: {key} must be a rotation")
    X = np.eye(4)
    X[:3, :3] = u @ vt
    X[:3, 3] = np.ravel(p)
    return X


def first_of(data: Mapping[str, Any], names: Sequence[str]) -> str | None:
    """Returns the first of several names that is a key of a file."""
    return next((name for name in names if name in data), None)


def image_size(path: str, width: Any, height: Any) -> tuple[int, int]:
    """Returns the width and height of an image as whole numbers [px].

    Raises DrakeTrackerError when they are none.
    """
    try:
        size = int(width), int(height)
    except (TypeError, ValueError, OverflowError):
        size = (-1, -1)
    if min(size) < 1 or size != (width, height):
        raise DrakeTrackerError(f"{path}: the image size is {str(width)[:20]} x {str(height)[:20]}; it must be whole")
    return size
