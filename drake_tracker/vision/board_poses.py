"""Where the ball's board is, to the camera and in the world: what the initialisation leaves to all that comes after."""

import zipfile
import zlib
from dataclasses import asdict, dataclass

import numpy as np
from pydrake.math import RigidTransform

from drake_tracker.core.errors import DrakeTrackerError

POSES_FILE = "board.npz"
"""Of the directory of a run: what the initialisation found."""
_TRANSFORMS = ("X_CB", "X_WB")


@dataclass(frozen=True)
class BoardPoses:
    """What the initialisation found: X_CB and X_WB (RigidTransform), the circles' reprojection error ``rms`` [px], the
    touched points (3, 3) [m, W], ``image``, the first reading (h, w, 3) in RGB, and ``circles``, shape (4, 2) [px]:
    where the images show `CIRCLES`."""

    X_CB: RigidTransform
    X_WB: RigidTransform
    rms: float
    points: np.ndarray
    image: np.ndarray
    circles: np.ndarray


def pose_error(estimate, truth):
    """Returns how far a RigidTransform is from the true one: (distance of origins [m], angle between [rad])."""
    distance = np.linalg.norm(estimate.translation() - truth.translation())
    turn = (truth.rotation().inverse() @ estimate.rotation()).ToAngleAxis().angle()
    return float(distance), float(abs(turn))


def save_poses(poses, path):
    """Writes `BoardPoses` as an npz file, from which `load_poses` reads them back to the last bit."""
    arrays = asdict(poses) | {name: getattr(poses, name).GetAsMatrix4() for name in _TRANSFORMS}
    np.savez_compressed(path, **arrays)


def load_poses(path):
    """Returns the `BoardPoses` of a file that `save_poses` wrote. Raises DrakeTrackerError when it cannot be read."""
    if not path.is_file():
        raise DrakeTrackerError(f"{path.parent}: there is no {path.name}, which says where the board was found")
    try:
        with np.load(path) as arrays:
            found = {name: arrays[name] for name in BoardPoses.__dataclass_fields__}
        poses = {name: RigidTransform(found[name]) for name in _TRANSFORMS}
        return BoardPoses(**found | poses | {"rms": float(found["rms"])})
    except (OSError, ValueError, EOFError, KeyError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise DrakeTrackerError(f"{path}: the board's poses cannot be read: {error}") from None
