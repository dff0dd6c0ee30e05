"""The board's pose relative to the camera and in the world: the result of the ball task's initialisation."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.files.npz_file import load_arrays
from drake_tracker.core.files.regular_file import open_regular
from drake_tracker.core.setting import as_tuple

POSES_FILE = "board.npz"
"""Name of the file in a run's directory that keeps the result of the initialisation."""
_MOST = 1 << 28
"""Largest size of the file, which has an image [bytes]."""
_TRANSFORMS = ("X_CB", "X_WB")


@dataclass(frozen=True)
class BoardPoses:
    """Results of the initialisation.

    Attributes:
        X_CB: the board in the camera's frame, from the circles.
        X_WB: the board in the world, from touching it.
        rms: reprojection error of the circles [px].
        points: the touched points, shape (3, 3) [m, W].
        image: the first image, RGB (h, w, 3).
        circles: shape (4, 2) [px], where the images show `CIRCLES`.
        windows: (u0, v0, width, height) [px] around each circle, as marked by a person; empty when they were found.
    """

    X_CB: RigidTransform
    X_WB: RigidTransform
    rms: float
    points: np.ndarray
    image: np.ndarray
    circles: np.ndarray
    windows: tuple[tuple[float, ...], ...] = ()


def pose_error(estimate: RigidTransform, truth: RigidTransform) -> tuple[float, float]:
    """Returns the error of a pose: (distance of the origins [m], angle of the rotation between them [rad])."""
    distance = np.linalg.norm(estimate.translation() - truth.translation())
    turn = (truth.rotation().inverse() @ estimate.rotation()).ToAngleAxis().angle()
    return float(distance), float(abs(turn))


def save_poses(poses: BoardPoses, path: Path) -> None:
    """Writes `BoardPoses` as an npz file, from which `load_poses` reads them back to the last bit."""
    arrays = asdict(poses) | {name: getattr(poses, name).GetAsMatrix4() for name in _TRANSFORMS}
    if not poses.windows:
        del arrays["windows"]
    with replacing(path) as beside:
        np.savez_compressed(beside, **arrays)


def load_poses(path: Path) -> BoardPoses:
    """Returns the `BoardPoses` of a file that `save_poses` wrote. Raises DrakeTrackerError when it cannot be read."""
    if not path.is_file():
        raise DrakeTrackerError(f"{path.parent}: there is no {path.name}, which says where the board was found")
    try:
        with open_regular(path, _MOST) as file:
            arrays = load_arrays(file, _MOST)
        found = {name: arrays[name] for name in BoardPoses.__dataclass_fields__ if name != "windows"}
        windows = as_tuple(arrays["windows"].tolist()) if "windows" in arrays else ()
        poses = {name: RigidTransform(found[name]) for name in _TRANSFORMS}
        return BoardPoses(**found | poses | {"rms": float(found["rms"]), "windows": windows})
    except Exception as error:  # numpy, zipfile and zlib raise many kinds of errors for a damaged file
        raise DrakeTrackerError(f"{path}: the board's poses cannot be read: {error}") from None
