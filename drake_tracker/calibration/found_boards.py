"""The board in photographs of one camera or two."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from drake_tracker.cameras.boards.board import Board, enough_points
from drake_tracker.cameras.boards.board_kinds import kind_of
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.boards.marker_boards import FAMILIES, AprilTagGrid, CharucoBoard
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.progress import StepsProgress
from drake_tracker.footage.decoding import common_orientation
from drake_tracker.footage.image_folder import list_images, read_image

LEAST_VIEWS = 5
"""Fewest pairs of photographs, or photographs of a single camera, with a board in them."""
COUNTS = {
    "chessboard": "inner corners, where four squares meet",
    "circles": "the circles of a row, and the rows",
    "asymmetric_circles": "the circles of a row, and the rows",
    "charuco": "squares",
    "apriltag": "tags",
}
"""The things that ``--board`` counts, for each kind."""
_OTHERS = 3
"""Number of photographs in which other boards are searched when none was found."""

ImageShape = tuple[int, int]
"""Height and width of an image [px]."""
CELLS = (6, 8)
"""Rows and columns of the cells into which the image is divided."""
LEAST_BOX = 0.2
"""Least area of the box round all points, as a fraction of the image; outside of the box, a lens is not determined."""


@dataclass(frozen=True)
class FoundBoards:
    """The photographs, or pairs of them, in which every camera sees the board.

    Attributes:
        names: file names of each photograph or pair.
        views: for each camera the points (n, 2) [px] in each of its photographs, NaN for hidden ones.
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


def find_boards(rows: Sequence[tuple[Path, ...]], board: Board, progress: StepsProgress) -> FoundBoards:
    """Returns the boards in photographs.

    Prints which photographs are skipped, because a camera does not see the board, or because they are copies.

    Args:
        rows: files of each photograph or pair, from `list_photographs`.
        board: the board.
        progress: shows how many photographs have been searched.

    Raises DrakeTrackerError when an image cannot be read, the images of a camera differ in size, or the board is found
    in fewer than `LEAST_VIEWS` photographs or pairs.
    """
    names: list[str] = []
    found: list[list[np.ndarray]] = []
    shapes: list[ImageShape] = []
    known: dict[bytes, str] = {}
    copies = 0
    turns = [common_orientation(column) for column in zip(*rows)]
    for line in (line for _, line in turns if line is not None):
        progress.close()
        print(line)
    for k, row in enumerate(rows):
        progress(k, len(rows), "looking for the board")
        images = [turn.apply(read_image(file, cv2.IMREAD_GRAYSCALE)) for file, (turn, _) in zip(row, turns)]
        here = [cast(ImageShape, image.shape) for image in images]
        shapes = shapes or here
        for file, shape, first in zip(row, here, shapes):
            if shape != first:
                raise DrakeTrackerError(
                    f"{file} has {shape[1]} x {shape[0]} px, those before have {first[1]} x {first[0]} px; "
                    "all images of a camera must have the same size"
                )
        name, content = " and ".join(map(str, row)), b"".join(image.tobytes() for image in images)
        original = known.setdefault(content, name)
        if original != name:
            progress.close()
            print(f"skipped {name}: the same as {original}")
            copies += 1
            continue
        points = [board.find(image) for image in images]
        missing = [str(file) for file, each in zip(row, points) if each is None]
        if missing:
            progress.close()
            print(f"skipped {name}: no board in {' and '.join(missing)}")
            continue
        seen = [each for each in points if each is not None]
        if not enough_points(np.sum(seen, axis=0)):  # NaN where a camera does not see a point
            progress.close()
            print(f"skipped {name}: the two images show different parts of the board")
            continue
        names.append(name)
        found.append(seen)
    if len(found) < LEAST_VIEWS:
        _refuse(rows, board, len(found), copies)
    return FoundBoards(names, list(zip(*found)), shapes)


def _refuse(rows: Sequence[tuple[Path, ...]], board: Board, found: int, copies: int) -> None:
    """Raises DrakeTrackerError: the board was found too rarely."""
    what = "pairs of images" if len(rows[0]) == 2 else "images"
    reason = f"--board counts {COUNTS[kind_of(board)]}"
    if copies:
        reason = f"{copies} of them are copies of others"
    elif not found:
        images = [read_image(row[0], cv2.IMREAD_GRAYSCALE) for row in rows[:_OTHERS]]
        for other, words, negative in _other_boards(board):
            if any(other.find(255 - image if negative else image) is not None for image in images):
                reason = f"{words} is there"
                break
    raise DrakeTrackerError(
        f"the {board.name} was found in {found} of {len(rows)} {what}; at least {LEAST_VIEWS} are needed; {reason}"
    )


def _other_boards(board: Board) -> Iterator[tuple[Board, str, bool]]:
    """Yields (board, its description, whether black and white are exchanged) of boards that are easily mistaken."""
    yield board, "this board with black and white exchanged", True
    if isinstance(board, Chessboard):
        for change in (-1, 1):
            columns, rows = board.columns + change, board.rows + change
            if min(columns, rows) >= 3:
                yield Chessboard(columns, rows), f"a board with {columns} x {rows} inner corners", False
    if isinstance(board, CharucoBoard | AprilTagGrid) and board.columns != board.rows:
        turned = replace(board, columns=board.rows, rows=board.columns)
        yield turned, f"a board with --board {turned.columns}x{turned.rows}", False
    if isinstance(board, CharucoBoard):
        for family in FAMILIES:
            if family != board.family:
                yield replace(board, family=family), f"a board with --family {family}", False
        former = replace(board)
        former._opencv.setLegacyPattern(True)
        yield former, "a board in the layout of OpenCV before 4.6, which is not supported,", False


def covered_cells(views: Sequence[np.ndarray], shape: tuple[int, int]) -> np.ndarray:
    """Returns which cells of an image contain points of the board in any view, booleans of the shape `CELLS`.

    Args:
        views: points (n, 2) [px], NaN for hidden ones.
        shape: (h, w) of the images [px].
    """
    points = np.concatenate(views)
    u, v = points[np.isfinite(points).all(axis=1)].T
    counts, _, _ = np.histogram2d(v, u, bins=CELLS, range=[(-0.5, shape[0] - 0.5), (-0.5, shape[1] - 0.5)])
    return counts > 0


def check_coverage(spec: str, views: Sequence[np.ndarray], shape: tuple[int, int]) -> None:
    """Raises DrakeTrackerError when the board was in one part of the image only.

    Args:
        spec: the photographs, for the message.
        views: points (n, 2) [px], NaN for hidden ones.
        shape: (h, w) of the images [px].
    """
    points = np.concatenate(views)
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    share = float(np.prod(high - low)) / (shape[0] * shape[1])
    if share < LEAST_BOX:
        u, v = 0.5 * (low + high) / (shape[1], shape[0])
        across = "left" if u < 0.4 else "right" if u > 0.6 else "middle"
        down = "upper" if v < 0.4 else "lower" if v > 0.6 else "middle"
        where = "middle" if across == down else f"{down} {across}"
        raise DrakeTrackerError(
            f"{spec}: the board is in one part of the image only, the {where} ({100 * share:.0f} % of it); take "
            "photographs of it near all edges and corners of the image, and closer"
        )
