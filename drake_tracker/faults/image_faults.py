"""Faults of the images: a dark camera, a frozen image, flicker, noise, and a cast shadow that moves over the table."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.faults.fault import FaultyView, ImageFault, PointFault, Sight
from drake_tracker.vision.light_gain import light_gain

SEEN_UNTIL, UNSEEN_FROM = 40.0, 60.0
"""Noise [grey levels] up to which the detector finds the train in every cycle, and from which it finds it in none. From
four levels of noise between 30 and 60 in the images of three runs."""
CENTROID_NOISE = 0.0016
"""Noise of a centroid [px] per square of the noise in the image [grey levels^2]. Noise hides an increasing part of the
train. The numbers were measured in the same images at four levels of noise between 10 and 40."""
IMAGE_SPAN = 4
"""Cycles between the first and the last image of the train's motion detector."""


@dataclass(frozen=True)
class CameraDarkFault(ImageFault, PointFault):
    """`CameraDark`: black images, in which nothing moves."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        dark = np.zeros_like(image)
        dark[..., 3] = 255
        return dark

    def centroid(self, sight: Sight) -> np.ndarray | None:
        return None


@dataclass(frozen=True)
class FrozenImageFault(ImageFault, PointFault):
    """`FrozenImage`: the same image again and again, in which nothing moves."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        return image if held is None else held

    def centroid(self, sight: Sight) -> np.ndarray | None:
        return None


@dataclass(frozen=True)
class FlickerFault(ImageFault, PointFault):
    """`Flicker`: a gain on the whole image.

    The motion detector scales its first image to the brightness of its last, and finds nothing when they differ too
    much (`light_gain`). Measured vision has no point in these cycles, and is otherwise undisturbed.
    """

    def gain(self, time: float) -> float:
        """Returns the gain of the light at a time [s]."""
        return 1.0 + self.settings.amplitude * np.sin(2.0 * np.pi * self.settings.frequency * (time - self.begin))

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        changed = cv2.convertScaleAbs(image, alpha=self.gain(time))
        changed[..., 3] = 255
        return changed

    def centroid(self, sight: Sight) -> np.ndarray | None:
        half = 0.5 * IMAGE_SPAN * VISION_PERIOD  # the stamp is that of the middle image
        levels = [self.gain(time) if self.active(time) else 1.0 for time in (sight.time - half, sight.time + half)]
        return None if light_gain(*levels) is None else sight.uv


@dataclass(frozen=True)
class ImageNoiseFault(ImageFault, PointFault):
    """`ImageNoise`: white luminance noise. Measured vision gets noise of the centroid, or sees nothing."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        random = self.random(len(view.camera), round(time / VISION_PERIOD))
        noise = self.settings.std * random.standard_normal(image.shape[:2], dtype=np.float32)
        changed = image.copy()
        changed[..., :3] = np.clip(np.rint(image[..., :3] + noise[..., np.newaxis]), 0.0, 255.0).astype(np.uint8)
        return changed

    def centroid(self, sight: Sight) -> np.ndarray | None:
        random, std = self.random(len(sight.camera), sight.cycle), self.settings.std
        hidden = (std - SEEN_UNTIL) / (UNSEEN_FROM - SEEN_UNTIL)
        if sight.uv is None or random.random() < hidden:
            return None
        return sight.uv + CENTROID_NOISE * std**2 * random.standard_normal(2)


MIDDLE = (0.56, 0.0)
"""Place in the world that the band crosses half-way [m]: the middle of the table."""
REACH = 0.5
"""Distance from there at which the band begins and ends a crossing [m]."""
TABLE_LEVEL = 45.0
"""Brightness of the table in the images [grey levels]."""
GATE = 6.0
"""Least change of brightness between the first and the last image at which the motion detector sees motion [grey
levels]."""
SHARE = 0.6
"""Fraction of the pixels with such a change in which the detector sees motion; the others are on the grain of the
wood."""
LEAST_AREA = 12.0
"""Least number of moving pixels that make a centroid."""
TRAIN_AREA = 0.0033
"""Area of the train in which the detector sees motion [m^2]."""
JOINED = 40.0
"""Distance [px] from the middle of the train up to which the detector takes the shadow and the train for one object: it
joins regions that are 24 px apart, and the train reaches 17 px to each side."""
CELL = 0.01
"""Side of the squares into which the table is divided [m]."""


@dataclass(frozen=True)
class CastShadowFault(ImageFault, PointFault):
    """`CastShadow`: each pixel shows less light where its ray meets the table in the shadow.

    The shadow lies on the plane of the table, also where the pixel shows the train or the arm above it. To the motion
    detector its edges are motion: all parts of the table in the work volume whose brightness changes enough. With
    measured vision, a camera finds the common centroid of shadow and train, weighted by their areas, if they are close
    to each other; otherwise it finds the larger of both.

    Attributes:
        table_height: height of the table's top [m].
        work_volume: lowest and highest corner of the box in which motion is searched for, in W [m].
    """

    table_height: float = 0.45
    work_volume: tuple[tuple[float, ...], ...] = ((0.33, -0.30, 0.45), (0.79, 0.30, 0.505))

    def hits(self, camera: str) -> bool:
        return camera != "wrist"

    def middle(self, time: float) -> float:
        """Returns the place of the band's middle along its motion [m], 0 at `MIDDLE`."""
        return (self.settings.speed * (time - self.begin)) % (2.0 * REACH) - REACH

    def light(self, along: np.ndarray, time: float) -> np.ndarray:
        """Returns the fraction of the light that is left at places on the table.

        Args:
            along: places along the motion of the band [m].
            time: [s].
        """
        distance = np.minimum(np.abs(along - self.middle(time)) / self.settings.width, 0.5)
        return 1.0 - self.settings.darkness * 0.5 * (1.0 + np.cos(2.0 * np.pi * distance))

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        xy = table_points(view.model, view.window, self.table_height)
        changed = image.copy()
        changed[..., :3] = np.rint(image[..., :3] * self.light(self.along(xy), time)[..., np.newaxis])
        return changed

    def along(self, xy: np.ndarray) -> np.ndarray:
        """Returns the places (...) of points (..., 2) in W along the motion of the band [m], 0 at `MIDDLE`."""
        heading = np.deg2rad(self.settings.heading_deg)
        return (xy - MIDDLE) @ [np.cos(heading), np.sin(heading)]

    def centroid(self, sight: Sight) -> np.ndarray | None:
        xy, uv, areas = table_cells(sight.model, self.work_volume, self.table_height)
        along, half = self.along(xy), 0.5 * IMAGE_SPAN * VISION_PERIOD  # the stamp is that of the middle image
        before, after = (self.light(along, time) for time in (sight.time - half, sight.time + half))
        moving = TABLE_LEVEL * np.abs(after - before) > GATE
        weights = SHARE * areas[moving]
        if weights.sum() < LEAST_AREA:
            return sight.uv
        shadow = weights @ uv[moving] / weights.sum()
        if sight.uv is None or sight.p_WQ is None:
            return shadow
        scale = sight.model.K[0, 0] / np.linalg.norm(sight.p_WQ - sight.model.X_WC[:3, 3])
        train = TRAIN_AREA * scale**2
        if np.min(np.hypot(*(uv[moving] - sight.uv).T)) <= JOINED:
            return (train * sight.uv + weights.sum() * shadow) / (train + weights.sum())
        return shadow if weights.sum() > train else sight.uv


@lru_cache(maxsize=4)
def table_points(model: CameraModel, window: tuple[int, int, int, int], height: float) -> np.ndarray:
    """Returns the points (h, w, 2) in W [m] at which the rays of a window's pixels meet a horizontal plane.

    Pixels that look above the horizon get points far away.

    Args:
        model: the camera.
        window: (u0, v0, width, height) [px].
        height: of the plane [m].
    """
    u0, v0, width, rows = window
    u, v = np.meshgrid(u0 + np.arange(width), v0 + np.arange(rows))
    origin, directions = model.rays(np.column_stack([u.ravel(), v.ravel()]))
    down = np.minimum(directions[:, 2], -1e-3)
    points = origin[:2] + directions[:, :2] * ((height - origin[2]) / down)[:, np.newaxis]
    points = points.reshape(rows, width, 2)
    points.setflags(write=False)
    return points


@lru_cache(maxsize=4)
def table_cells(
    model: CameraModel, work_volume: tuple[tuple[float, ...], ...], height: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the squares of the table within the ellipse of the work volume, as a camera sees them.

    Args:
        model: the camera.
        work_volume: lowest and highest corner of the box that circumscribes the ellipse, in W [m].
        height: of the table's top [m].

    Returns (places in W (n, 2) [m], pixels (n, 2), areas in the image (n,) [px^2]).
    """
    low, high = (np.array(corner[:2]) for corner in work_volume)
    x, y = np.meshgrid(*(np.arange(a, b, CELL) for a, b in zip(low, high)))
    xy = np.column_stack([x.ravel(), y.ravel()])
    xy = xy[np.sum(((2.0 * xy - low - high) / (high - low)) ** 2, axis=1) <= 1.0]

    def pixels(dx: float, dy: float) -> np.ndarray:
        return model.project(np.column_stack([xy + [dx, dy], np.full(len(xy), height)]))

    uv, along_x, along_y = pixels(0.0, 0.0), pixels(CELL, 0.0), pixels(0.0, CELL)
    (ax, ay), (bx, by) = (along_x - uv).T, (along_y - uv).T
    areas = np.abs(ax * by - ay * bx)
    for array in (xy, uv, areas):
        array.setflags(write=False)
    return xy, uv, areas
