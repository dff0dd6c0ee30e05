"""A cast shadow: a soft band that moves over the table."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drake_tracker.faults.fault import ImageFault, PointFault, Sight, View
from drake_tracker.vision.camera_model import CameraModel

MIDDLE = (0.56, 0.0)
"""Place in the world that the band crosses half-way [m]: the middle of the table."""
REACH = 0.5
"""Distance from there at which the band begins and ends a crossing [m]."""


@dataclass(frozen=True)
class CastShadowFault(ImageFault, PointFault):
    """`CastShadow`: each pixel shows less light where its ray meets the table in the shadow.

    The shadow lies on the plane of the table, also where the pixel shows the train or the arm above it. Measured vision
    takes it for no motion: its soft edges on the dark table change too little for the motion detector, which also
    follows the brightness.

    Attributes:
        table_height: height of the table's top [m].
    """

    table_height: float = 0.45

    def hits(self, camera: str) -> bool:
        return True

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

    def image(self, image: np.ndarray, view: View, time: float, held: np.ndarray | None) -> np.ndarray:
        xy = table_points(view.model, view.window, self.table_height)
        heading = np.deg2rad(self.settings.heading_deg)
        along = (xy - MIDDLE) @ [np.cos(heading), np.sin(heading)]
        changed = image.copy()
        changed[..., :3] = np.rint(image[..., :3] * self.light(along, time)[..., np.newaxis])
        return changed

    def centroid(self, sight: Sight) -> np.ndarray | None:
        return sight.uv


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
