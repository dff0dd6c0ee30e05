"""The chessboard in photographs of one camera or two."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.progress import StepsProgress
from drake_tracker.footage.image_files import list_images, read_image
from drake_tracker.vision.chessboard import Chessboard, find_corners

LEAST_VIEWS = 5
"""Fewest pairs of photographs, or photographs of a single camera, with a board in them."""

ImageShape = tuple[int, int]
"""Height and width of an image [px]."""


@dataclass(frozen=True)
class FoundBoards:
    """The photographs, or pairs of them, in which every camera sees the board.

    Attributes:
        names: file names of each photograph or pair.
        views: for each camera the corners (n, 2) [px] in each of its photographs.
        shapes: for each camera the shape of its images.
    """

    names: list[str]
    views: list[tuple[np.ndarray, ...]]
    shapes: list[ImageShape]


def list_photographs(specs: Sequence[str]) -> list[tuple[Path, ...]]:
    """Returns the files of each photograph of one camera, or of each pair of photographs of two.

    Args:
        specs: for each camera a folder or a pattern of images; the images of two cameras are paired in their order.

    Raises DrakeTrackerError, in one line, when images are missing or cannot be paired.
    """
    files = [list_images(spec) for spec in specs]
    if len(files) == 2 and files[0] == files[1]:
        raise DrakeTrackerError(f"{specs[0]} and {specs[1]}: these are the same images; give those of each camera")
    if len(set(map(len, files))) > 1:
        raise DrakeTrackerError(
            f"{specs[0]} has {len(files[0])} images and {specs[1]} has {len(files[1])}; every pair needs both"
        )
    return list(zip(*files))


def find_boards(rows: Sequence[tuple[Path, ...]], board: Chessboard, progress: StepsProgress) -> FoundBoards:
    """Returns the boards in photographs. Prints which photographs are skipped because a camera does not see the board.

    Args:
        rows: files of each photograph or pair, from `list_photographs`.
        board: the chessboard.
        progress: shows how many photographs have been searched.

    Raises DrakeTrackerError when an image cannot be read, the images of a camera differ in size, or the board is found
    in fewer than `LEAST_VIEWS` photographs or pairs.
    """
    names: list[str] = []
    found: list[list[np.ndarray]] = []
    shapes: list[ImageShape] = []
    for k, row in enumerate(rows):
        progress(k, len(rows), "looking for the board")
        images = [read_image(file, cv2.IMREAD_GRAYSCALE) for file in row]
        here = [cast(ImageShape, image.shape) for image in images]
        shapes = shapes or here
        for file, shape, first in zip(row, here, shapes):
            if shape != first:
                raise DrakeTrackerError(
                    f"{file} has {shape[1]} x {shape[0]} px, those before have {first[1]} x {first[0]} px; "
                    "all images of a camera must have the same size"
                )
        corners = [find_corners(image, board) for image in images]
        missing = [str(file) for file, each in zip(row, corners) if each is None]
        if missing:
            progress.close()
            print(f"skipped {' and '.join(map(str, row))}: no board in {' and '.join(missing)}")
            continue
        names.append(" and ".join(map(str, row)))
        found.append([each for each in corners if each is not None])
    if len(found) < LEAST_VIEWS:
        what = "pairs of images" if len(rows[0]) == 2 else "images"
        raise DrakeTrackerError(
            f"the {board.columns} x {board.rows} board was found in {len(found)} of {len(rows)} {what}; at least "
            f"{LEAST_VIEWS} are needed; --board counts inner corners, where four squares meet"
        )
    return FoundBoards(names, list(zip(*found)), shapes)
