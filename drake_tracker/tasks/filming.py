"""A task's description for the recorders of a run: the content of its camera video and of its 3-D recording.

This module holds data only. The Systems that draw are in `drake_tracker.run`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.tasks.episode import Log

FRAMES_PER_SECOND = 30
"""Frame rate of the camera video and of the 3-D recording: every second camera image."""
HAND_BORDER = 20
"""Width of the border around the window of a single camera [px]. It shows the hand, which moves outside the window."""
PATH_MARKS = 9
"""Number of points with which the 3-D recording marks a predicted path."""
NO_POINTS = np.zeros((0, 3))
NO_POINTS.flags.writeable = False

PathFunction = Callable[[np.ndarray, float], np.ndarray]
"""(vector of a valid `Prediction`, present time [s]) -> points p_WQ to draw [m], shape (n, 3)."""


def no_points(packet: np.ndarray, now: float) -> np.ndarray:
    """A `PathFunction` that returns no points.

    Args:
        packet: vector of a valid `Prediction`, ignored.
        now: present time [s], ignored.
    """
    return NO_POINTS


def port_of(kind: str, side: str) -> str:
    """Returns the name of a port of one camera: ``camera_left`` of a pair, ``camera`` of a single camera.

    Args:
        kind: what the port carries, for example "camera" or "centroid".
        side: suffix of the camera, "" for a single camera.
    """
    return f"{kind}_{side}" if side else kind


@dataclass(frozen=True)
class Script:
    """Content of a camera video in addition to the images.

    Attributes:
        phases: enumeration of the phases.
        predicting: phases in which a predicted path is drawn.
        diagnosis: named view of the ``diagnosis`` port.
        notes: (phase, diagnosis) -> two short lines of text.
        path: points of the predicted path.
        goal: predicted arrival of the object: its position and the two ends of an error bar, or no points.
    """

    phases: type[IntEnum]
    predicting: tuple[IntEnum, ...]
    diagnosis: Any
    notes: Callable[[IntEnum, Any], tuple[str, str]]
    path: PathFunction
    goal: PathFunction = no_points


@dataclass(frozen=True, eq=False)
class Film:
    """Content of the camera video of one run.

    Attributes:
        title: first line of text.
        subtitle: second line of text.
        polygons: {side: corners of the window of interest [px], shape (n, 2)}.
        image_size: (width, height) of the full images [px].
        cameras: {side: calibrated camera with its pose in W}.
        offsets: {side: (u0, v0) of the first pixel of its images in the full image [px]}.
        lag: time from the stamp of a centroid until it appears [s].
        lag_cycles: the same time in cycles.
        script: what is written and drawn.
        goal: name of the mark that ``script.goal`` draws, None where there is no such mark.
        every: number of cycles between two images that are kept; the others are not rendered for the video.
        update_cycles: number of cycles between two centroids.
        image_latency: number of cycles from the capture of an image until its port shows it.
        several: whether vision tracks several objects, so that there are the ports ``regions_*`` and ``tracks``.
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
    image_latency: int = 0
    several: bool = False


@dataclass(frozen=True)
class Snapshot:
    """When to keep the intermediate images of the motion detector, and how to draw them.

    Attributes:
        sides: suffixes of the cameras' ports.
        phases: phases in which images are kept; later ones in this tuple are preferred.
        period: time between two evaluations of the images [s].
        draw: ({side: images}, path of a PNG file) -> None.
    """

    sides: tuple[str, ...]
    phases: tuple[IntEnum, ...]
    period: float
    draw: Callable[[dict[str, Any], Path], None]


@dataclass(frozen=True, eq=False)
class Frame:
    """The images of all cameras at one instant.

    Attributes:
        time: at which they were captured [s].
        images: {side: image, BGR uint8 of shape (height, width, 3)}.
    """

    time: float
    images: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Closeup:
    """Which camera images are kept for a picture of the grasp, and how to draw it.

    Attributes:
        file: name of the picture in the run directory.
        sides: suffixes of the cameras' ports.
        phase: phase in which the hand closes. The images around its last beginning are kept.
        before: time before its beginning from which on images are kept [s].
        after: time after its beginning up to which images are kept [s].
        image_latency: number of cycles from the capture of an image until its port shows it.
        draw: (frames in the order of time, log of the run, path of a PNG file) -> None. It writes no file when the log
            has no grasp in the time of the frames.
    """

    file: str
    sides: tuple[str, ...]
    phase: IntEnum
    before: float
    after: float
    image_latency: int
    draw: Callable[[Sequence[Frame], Log, Path], None]


@dataclass(frozen=True)
class View:
    """How the 3-D recording shows a task.

    Attributes:
        phases: phases in which a predicted path is drawn.
        path: points of the predicted path, `PATH_MARKS` of them or none.
        eye: position of the viewer (x, y, z) in W [m].
        target: point that the viewer looks at (x, y, z) in W [m].
        fov_deg: field of view [deg].
        floor: whether to draw a floor, for a laboratory without one.
    """

    phases: tuple[IntEnum, ...]
    path: PathFunction
    eye: tuple[float, float, float] = (1.95, -1.20, 1.25)
    target: tuple[float, float, float] = (0.38, 0.02, 0.58)
    fov_deg: float = 37.0
    floor: bool = True
