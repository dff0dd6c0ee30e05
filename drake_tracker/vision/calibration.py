"""Camera calibration from images of a chessboard: lens, place, and the file that keeps them.

Nothing here knows how the images came about: photographs do as well as rendered ones. The lens (focal length and
distortion) comes from views of a board held at many angles, the place of the camera from a board that lies at known
places. Each camera is located by itself, because a chain through the other camera adds the errors of both.
"""

import dataclasses
import os
from pathlib import Path

import cv2
import numpy as np
import yaml

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.chessboard import find_corners

MIN_LENS_VIEWS = 3
"""Fewest views of a board from which a lens is calibrated."""
_CAMERA_ARRAYS = {"K": (3, 3), "distortion": (5,), "X_CW": (4, 4)}
_DIGITS = 9
_ROTATION_TOLERANCE = 1e-6


@dataclasses.dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsic parameters: K (3, 3) [px], distortion (5,); of the views that they are of the reprojection error
    [px rms], and the greatest angle between two boards [rad]: of boards held alike no lens can be told."""

    K: np.ndarray
    distortion: np.ndarray
    rms: float
    spread: float


def calibrate_intrinsics(images, board, **options):
    """Returns the `Lens` of a camera from grey images (h, w) of a board held at many angles.

    Images in which the board is not found are passed over. ``options`` are those of `lens_from_corners`. Raises
    DrakeTrackerError when the board is found in fewer than `MIN_LENS_VIEWS` images.
    """
    views = [corners for corners in (find_corners(image, board) for image in images) if corners is not None]
    if len(views) < MIN_LENS_VIEWS:
        raise DrakeTrackerError(
            f"the {board.columns} x {board.rows} board was found in {len(views)} of {len(images)} images; "
            f"a lens needs at least {MIN_LENS_VIEWS}"
        )
    return lens_from_corners(views, board, images[0].shape, **options)


def lens_from_corners(
    views, board, shape, *, fix_principal_point=True, fix_aspect_ratio=True, radial_terms=0, tangential=False
):
    """Returns the `Lens` that explains the corners (n, 2) [px] of a board in several images of ``shape`` (h, w).

    By default the principal point stays at the image's centre and the pixels are square: freed, they trade against the
    board's pose, and small images are too coarse to part them. ``radial_terms`` 0..3 is the number of k1, k2, k3 to
    find, ``tangential`` adds p1 and p2.
    """
    flags = 0
    for fixed, flag in (
        (fix_principal_point, cv2.CALIB_FIX_PRINCIPAL_POINT),
        (fix_aspect_ratio, cv2.CALIB_FIX_ASPECT_RATIO),
        (not tangential, cv2.CALIB_ZERO_TANGENT_DIST),
        (radial_terms < 1, cv2.CALIB_FIX_K1),
        (radial_terms < 2, cv2.CALIB_FIX_K2),
        (radial_terms < 3, cv2.CALIB_FIX_K3),
    ):
        flags |= flag if fixed else 0
    # The aspect ratio that is kept is that of the matrix handed in.
    rms, K, distortion, turns, _ = cv2.calibrateCamera(
        *_opencv_lists(board, views), shape[::-1], np.eye(3), np.zeros(5), flags=flags
    )
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    spread = float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())
    return Lens(K, distortion.ravel()[:5], rms, spread)


def locate_camera(images, lens, board, poses):
    """Returns where a camera stands, from grey images (h, w) of a board at known places.

    Parameters:
        lens: the camera's `Lens`.
        poses: X_WB (4, 4) of the board [m], one for each image.

    Returns (X_CW, rms): the (4, 4) matrix that takes p_WQ to p_CQ and the reprojection error [px]. Raises
    DrakeTrackerError when the board is not found in an image.
    """
    pixels, points = [], []
    for index, (image, X_WB) in enumerate(zip(images, poses, strict=True)):
        corners = find_corners(image, board)
        if corners is None:
            raise DrakeTrackerError(f"the {board.columns} x {board.rows} board was not found in image {index}")
        pixels.append(corners)
        points.append(board.corners() @ X_WB[:3, :3].T + X_WB[:3, 3])
    pixels, points = np.concatenate(pixels), np.concatenate(points)
    _, rotation, translation = cv2.solvePnP(points, pixels, lens.K, lens.distortion, flags=cv2.SOLVEPNP_ITERATIVE)
    miss = cv2.projectPoints(points, rotation, translation, lens.K, lens.distortion)[0][:, 0] - pixels
    return _transform(cv2.Rodrigues(rotation)[0], translation), np.sqrt((miss**2).sum(axis=1).mean())


def stereo_from_corners(views_left, views_right, board, shape, shape_right=None, **options):
    """Returns (left, right, rms): two `CameraModel`s from the corners (n, 2) [px] of one board in pairs of images.

    For cameras whose world is not known: W is the left camera's own frame and the board's square the unit of length.
    ``shape`` (h, w) is that of the images, ``shape_right`` of the right ones if they differ, ``options`` are those of
    `lens_from_corners`, and rms is the reprojection error [px] of both cameras together.
    """
    shape_right = shape_right or shape
    left = lens_from_corners(views_left, board, shape, **options)
    right = lens_from_corners(views_right, board, shape_right, **options)
    points, pixels_left = _opencv_lists(board, views_left)
    _, pixels_right = _opencv_lists(board, views_right)
    rms, _, _, _, _, R, t, *_ = cv2.stereoCalibrate(
        points,
        pixels_left,
        pixels_right,
        left.K,
        left.distortion,
        right.K,
        right.distortion,
        shape[::-1],
        flags=cv2.CALIB_FIX_INTRINSIC,
    )
    return (
        CameraModel(left.K, left.distortion, np.eye(4), *shape[::-1]),
        CameraModel(right.K, right.distortion, _transform(R, t), *shape_right[::-1]),
        rms,
    )


def board_pose(corners, camera, board):
    """Returns X_CB (4, 4) of a board from the pixels (n, 2) of its corners in one image of a `CameraModel`."""
    _, rotation, translation = cv2.solvePnP(board.corners(), corners, camera.K, camera.distortion)
    return _transform(cv2.Rodrigues(rotation)[0], translation)


def _opencv_lists(board, views):
    """Returns the board's points and the views' pixels, one array for each view, in the types that OpenCV takes."""
    return [board.corners().astype(np.float32)] * len(views), [view.astype(np.float32) for view in views]


def _transform(R, p):
    X = np.eye(4)
    X[:3, :3] = R
    X[:3, 3] = np.ravel(p)
    return X


def save_calibration(path, cameras, *, rig=None, notes=None):
    """Writes {name: CameraModel} to a YAML file.

    ``rig`` {name: value} says for which arrangement of cameras the file was made, ``notes`` {name: value} is anything
    worth keeping: the board, the errors. Both are plain numbers, texts and lists. Raises DrakeTrackerError when the
    file cannot be written; one that was there before is then left as it was.
    """
    data = {"rig": rig or {}, "notes": notes or {}, "cameras": {}}
    for name, camera in cameras.items():
        data["cameras"][name] = {"width": camera.width, "height": camera.height} | {
            key: np.round(getattr(camera, key), _DIGITS).tolist() for key in _CAMERA_ARRAYS
        }
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=120)
    part = Path(f"{path}.part")
    try:
        part.write_text("# Camera matrices found from images of a chessboard.\n" + text, encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise DrakeTrackerError(f"{path}: the calibration cannot be written: {error.strerror}") from None


def load_calibration(path, rig=None):
    """Returns {name: CameraModel} from a file that `save_calibration` wrote.

    When ``rig`` is given, every value in it must be that of the file.

    Raises DrakeTrackerError, one line naming the file and the key, when the file is missing or not YAML, a value is
    missing, of another shape or not finite, when X_CW is not a pose or K not a camera matrix, or when the rig differs.
    """
    data = _read_yaml(path)
    entries = _mapping(path, data, "cameras")
    if rig is not None:
        check_rig(path, _mapping(path, data, "rig"), rig, "calibrate")
    return {name: _read_camera(path, f"cameras.{name}", _mapping(path, entries, name)) for name in entries}


def load_pose(path, *keys):
    """Returns the pose (4, 4) that stands under a path of keys in a YAML file.

    Raises DrakeTrackerError, one line naming the file and the key, when the file cannot be read or it is no pose.
    """
    entry, name = _read_yaml(path), ".".join(keys)
    for key in keys:
        entry = entry.get(key) if isinstance(entry, dict) else None
    try:
        X = np.array(entry, dtype=float)
    except (TypeError, ValueError):
        X = np.empty(0)
    if X.shape != (4, 4) or not _is_pose(X):
        raise DrakeTrackerError(f"{path}: {name} must hold 4 x 4 numbers, a rotation and a translation above 0 0 0 1")
    return X


def _read_yaml(path):
    try:
        return yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise DrakeTrackerError(
            f"{path}: the calibration cannot be read ({getattr(error, 'strerror', None) or 'it is not text'}); "
            "make one with drake-tracker calibrate"
        ) from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" line {mark.line + 1}" if mark else ""
        raise DrakeTrackerError(f"{path}{where}: {getattr(error, 'problem', None) or 'this is not YAML'}") from None


def _mapping(path, data, key):
    value = data.get(key) if isinstance(data, dict) else None
    if not isinstance(value, dict):
        raise DrakeTrackerError(f"{path}: {key} is missing or not a mapping")
    return value


def check_rig(path, found, wanted, command):
    """Raises DrakeTrackerError when a file was made for cameras ``found`` and the scenario's are ``wanted``, both as
    `world.cameras.describe_rig` has them. ``command``: of drake-tracker, which makes such a file.
    """
    for key, value in wanted.items():
        own = found.get(key) if isinstance(found, dict) else None
        if own is None or np.shape(own) != np.shape(value) or not np.allclose(own, value):
            raise DrakeTrackerError(
                f"{path}: made with rig.{key} = {own}, but the scenario's cameras have {value}; make it anew with "
                f"drake-tracker {command}"
            )


def _read_camera(path, key, entry):
    sizes, arrays = {}, {}
    for name in ("width", "height"):
        sizes[name] = entry.get(name)
        if type(sizes[name]) is not int or sizes[name] < 1:
            raise DrakeTrackerError(f"{path}: {key}.{name} is {sizes[name]!r}; it must be a whole number above 0")
    for name, shape in _CAMERA_ARRAYS.items():
        try:
            arrays[name] = np.array(entry.get(name), dtype=float)
        except (TypeError, ValueError):
            arrays[name] = np.empty(0)
        if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
            raise DrakeTrackerError(f"{path}: {key}.{name} must hold {' x '.join(map(str, shape))} finite numbers")
    K, X_CW = arrays["K"], arrays["X_CW"]
    if K[0, 0] <= 0.0 or K[1, 1] <= 0.0 or not np.allclose(K[[1, 2, 2, 2], [0, 0, 1, 2]], [0.0, 0.0, 0.0, 1.0]):
        raise DrakeTrackerError(f"{path}: {key}.K must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above 0")
    if not _is_pose(X_CW):
        raise DrakeTrackerError(f"{path}: {key}.X_CW must be a rotation and a translation, last row 0 0 0 1")
    return CameraModel(**arrays, **sizes)


def _is_pose(X):
    R = X[:3, :3]
    proper = np.allclose(R @ R.T, np.eye(3), atol=_ROTATION_TOLERANCE) and np.linalg.det(R) > 0.0
    return proper and np.isfinite(X).all() and np.array_equal(X[3], [0.0, 0.0, 0.0, 1.0])
