"""What the recorders of a run need to know of a task: what its camera video and its 3-D recording show.

These are data. The Systems that draw are in `drake_tracker.run`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.vision.camera_model import CameraModel

FRAMES_PER_SECOND = 30
"""Frame rate of the camera video and of the 3-D recording: every second camera image."""
PATH_MARKS = 9
"""Points by which the 3-D recording marks a predicted path."""
STEREO_SIDES = ("left", "right")
"""Suffixes of the ports of two cameras; that of a single camera is the empty text."""
NO_POINTS = np.zeros((0, 3))
NO_POINTS.flags.writeable = False

PathFunction = Callable[[np.ndarray, float], np.ndarray]
"""(valid `Prediction` vector, time now [s]) -> points p_WQ [m], shape (n, 3)."""


def no_points(packet: np.ndarray, now: float) -> np.ndarray:
    """A `PathFunction` that marks nothing."""
    return NO_POINTS


def port_of(kind: str, side: str) -> str:
    """Returns the name of a port of one camera: ``camera_left`` of a pair, ``camera`` of a single one."""
    return f"{kind}_{side}" if side else kind


@dataclass(frozen=True)
class Script:
    """What a camera video says besides the images.

    Attributes:
        phases: enumeration of the phases.
        predicting: phases in which a predicted path is shown.
        diagnosis: named view of the ``diagnosis`` port.
        notes: (phase, diagnosis) -> two short lines of text.
        path: the predicted path that is drawn.
        goal: where the object is expected to arrive: the place and the two ends of an error bar, or none.
    """

    phases: type[IntEnum]
    predicting: tuple[IntEnum, ...]
    diagnosis: Any
    notes: Callable[[IntEnum, Any], tuple[str, str]]
    path: PathFunction
    goal: PathFunction = no_points


@dataclass(frozen=True, eq=False)
class Film:
    """What the camera video of one run shows.

    Attributes:
        title: first line of text.
        subtitle: second line of text.
        polygons: {side: corners (n, 2) [px]} of the windows of interest.
        image_size: (width, height) of the full images [px].
        cameras: {side: calibrated `CameraModel`} with poses in W.
        offsets: {side: (u0, v0)}, the pixel of the full image that is the first one of the images.
        lag: time from an image to its centroid [s].
        lag_cycles: the same in cycles.
        script: what is written and drawn.
        goal: name of the mark that ``script.goal`` draws, or None.
        every: cycles from one image that is kept to the next; others are not rendered for the video.
        update_cycles: cycles from one centroid to the next.
    """

    title: str
    subtitle: str
    polygons: Mapping[str, np.ndarray]
    image_size: tuple[int, int]
    cameras: Mapping[str, CameraModel]
    offsets: Mapping[str, tuple[int, int]]
    lag: float
    lag_cycles: float
    script: Script
    goal: str | None = None
    every: int = 1
    update_cycles: int = 1


@dataclass(frozen=True)
class Snapshot:
    """When to keep the intermediate images of the motion detector, and how to draw them.

    Attributes:
        sides: of the ports' names.
        phases: phases in which the images are kept; later ones are preferred.
        period: time between two looks [s].
        draw: ({side: images}, path of a PNG file) -> None.
    """

    sides: tuple[str, ...]
    phases: tuple[IntEnum, ...]
    period: float
    draw: Callable[[dict[str, Any], Path], None]


@dataclass(frozen=True)
class View:
    """How the 3-D recording shows a task.

    Attributes:
        phases: phases in which a predicted path is drawn.
        path: its points, `PATH_MARKS` of them or none.
        eye: position of the viewer (x, y, z) [m, W].
        target: the point it looks at (x, y, z) [m, W].
        fov_deg: field of view [deg].
        floor: whether a floor is drawn, for a laboratory without one.
    """

    phases: tuple[IntEnum, ...]
    path: PathFunction
    eye: tuple[float, float, float] = (1.95, -1.20, 1.25)
    target: tuple[float, float, float] = (0.38, 0.02, 0.58)
    fov_deg: float = 37.0
    floor: bool = True
