"""Calibrates cameras of one's own from photographs of a chessboard, and says how good the result is."""

import dataclasses
import re
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.progress import StepsProgress
from drake_tracker.footage.image_files import list_images, read_image
from drake_tracker.vision.calibration import board_pose, lens_from_corners, stereo_from_corners
from drake_tracker.vision.calibration_file import save_calibration
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.chessboard import Chessboard, find_corners
from drake_tracker.vision.left_out import left_out_errors

LEAST_VIEWS = 5
"""Fewest pairs of photographs, or photographs of a single camera, with a board in them."""
WORST_RMS = 3.0
"""A reprojection error [px] beyond this is not that of a lens: the board is another one, or the pairs are mixed up."""
LEAST_SPREAD = np.radians(15.0)
"""Least angle between the boards of two photographs: held alike in all of them they do not tell what the lens is."""
LEAST_BASELINE = 0.2
"""Least distance between two cameras, in squares of the board."""
LARGEST_SQUARE = 1.0
"""Largest side of a square [m]; more are millimetres."""
MOST_LEFT_OUT = 20
"""Pairs that are left out in turn to see how good the rest is."""
LENS_OPTIONS = {"fix_principal_point": False, "fix_aspect_ratio": False, "radial_terms": 2, "tangential": True}
"""What is free in a real lens, beside its focal length (`lens_from_corners`)."""
X_BP = np.diag([1.0, -1.0, -1.0, 1.0])
"""Takes p_PQ to p_BQ: P is the board's plane with z towards who looks at it, B the frame of `Chessboard`."""


def parse_board(text, square):
    """Returns the `Chessboard` of ``text`` "9x6" (inner corners) with squares of ``square`` [m].

    Raises DrakeTrackerError when either is missing or wrong.
    """
    match = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text)
    if not match:
        raise DrakeTrackerError(f"--board {text}: give the inner corners as COLUMNSxROWS, for example 9x6")
    if square is None:
        raise DrakeTrackerError("--square is missing: the side of one square of the board [m], for example 0.025")
    if not 1e-4 <= square <= LARGEST_SQUARE:
        raise DrakeTrackerError(f"--square {square:g}: the side of a square must lie in 0.0001..{LARGEST_SQUARE:g} m")
    return Chessboard(int(match[1]), int(match[2]), square)


def calibrate_photographs(specs, board, path, *, world=False):
    """Calibrates one camera or two from photographs, prints the errors, and writes the calibration file ``path``.

    Args:
        specs: of each camera a folder or a quoted pattern of images; two cameras' images are paired in their order.
        board: `Chessboard`.
        world: W is P, the plane of the board in the first photograph in which it was found: origin at the board's
            first inner corner, x along its columns, z towards the camera. Otherwise W is the frame of the (left)
            camera, x right, y down, z forward.

    Returns {name: CameraModel}: camera_left and camera_right, or a single camera's camera_left. Raises
    DrakeTrackerError, one line, on images that cannot be read or paired, on too few with the board in them, and when
    the board cannot have been that one.
    """
    if not Path(path).absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: there is no folder {Path(path).parent}")
    if Path(path).is_dir():
        raise DrakeTrackerError(f"-o {path}: is a folder; name a file")
    files = [list_images(spec) for spec in specs]
    if len(files) == 2 and files[0] == files[1]:
        raise DrakeTrackerError(f"{specs[0]} and {specs[1]}: these are the same images; give those of each camera")
    if len(set(map(len, files))) > 1:
        raise DrakeTrackerError(
            f"{specs[0]} has {len(files[0])} images and {specs[1]} has {len(files[1])}; every pair needs both"
        )
    with closing(StepsProgress()) as progress:
        names, views, shapes = _find_boards(list(zip(*files)), board, progress)
    for spec, views_of_one, shape in zip(specs, views, shapes):
        spread = lens_from_corners(views_of_one, board, shape, **LENS_OPTIONS).spread
        if spread < LEAST_SPREAD:
            raise DrakeTrackerError(
                f"{spec}: the board is held alike in all images, within {np.degrees(spread):.0f} deg; take photographs "
                "of it tilted to all sides, by 20 deg and more"
            )
    errors = {}
    if len(specs) == 1:
        (views_left,), (shape,) = views, shapes
        lens = lens_from_corners(views_left, board, shape, **LENS_OPTIONS)
        left, rms = CameraModel(lens.K, lens.distortion, np.eye(4), *shape[::-1]), lens.rms
        cameras = {"camera_left": left}
        print(f"lens: reprojection {rms:.3f} px rms ({len(views_left)} images)")
    else:
        left, right, rms = stereo_from_corners(*views, board, *shapes, **LENS_OPTIONS)
        cameras = {"camera_left": left, "camera_right": right}
        print(f"both cameras: reprojection {rms:.3f} px rms ({len(names)} pairs)")
    if not rms <= WORST_RMS:
        raise DrakeTrackerError(
            f"the reprojection error is {rms:.1f} px, no lens is that bad: either the board has not "
            f"{board.columns} x {board.rows} inner corners, or the images are not pairs of one moment"
        )
    if len(specs) == 2:
        if np.linalg.norm(right.X_WC[:3, 3]) < LEAST_BASELINE * board.square:
            raise DrakeTrackerError(f"{specs[0]} and {specs[1]}: both cameras stand at one place; are they two?")
        print(f"distance between the cameras: {np.linalg.norm(right.X_WC[:3, 3]):.4g} m")
        with closing(StepsProgress()) as progress:
            wrong = left_out_errors(*views, board, *shapes, most=MOST_LEFT_OUT, progress=progress, **LENS_OPTIONS)
        if len(wrong):
            errors = {"square_left_out_mean": float(wrong.mean()), "square_left_out_worst": float(wrong.max())}
            print(
                f"a square of a pair that was left out is off by {100 * wrong.mean():.2f} % on average, "
                f"{100 * wrong.max():.2f} % at worst"
            )
    X_WP = board_pose(views[0][0], left, board) @ X_BP
    if world:
        cameras = {name: dataclasses.replace(camera, X_CW=camera.X_CW @ X_WP) for name, camera in cameras.items()}
        X_WP = np.eye(4)
    notes = {
        "board": dataclasses.asdict(board),
        "world": "board" if world else "camera_left",
        "X_WP": np.round(X_WP, 9).tolist(),
        "X_WP_from": names[0],
        "reprojection_rms_px": round(float(rms), 4),
        "error": {name: round(value, 6) for name, value in errors.items()},
    }
    save_calibration(path, cameras, notes=notes)
    print(f"wrote {path}")
    return cameras


def _find_boards(rows, board, progress):
    """Returns (names, views, shapes) of the rows of files, one a camera, in which every camera sees the board.

    names: of the row's files. views: for each camera the corners (n, 2) [px]. shapes: of each camera's images (h, w).
    Rows in which a camera misses it are named and passed over.
    """
    names, found, shapes = [], [], None
    for k, row in enumerate(rows):
        progress(k, len(rows), "looking for the board")
        images = [read_image(file, cv2.IMREAD_GRAYSCALE) for file in row]
        here = [image.shape for image in images]
        shapes = shapes or here
        for file, shape, first in zip(row, here, shapes):
            if shape != first:
                raise DrakeTrackerError(
                    f"{file} has {shape[1]} x {shape[0]} px, those before have {first[1]} x {first[0]} px; "
                    "a camera's images must be of one size"
                )
        corners = [find_corners(image, board) for image in images]
        without = [str(file) for file, each in zip(row, corners) if each is None]
        if without:
            progress.close()
            print(f"passed over {' and '.join(map(str, row))}: no board in {' and '.join(without)}")
            continue
        names.append(" and ".join(map(str, row)))
        found.append(corners)
    if len(found) < LEAST_VIEWS:
        what = "pairs of images" if len(rows[0]) == 2 else "images"
        raise DrakeTrackerError(
            f"the {board.columns} x {board.rows} board was found in {len(found)} of {len(rows)} {what}, at least "
            f"{LEAST_VIEWS} are needed; --board counts inner corners, where four squares meet"
        )
    return names, list(zip(*found)), shapes
