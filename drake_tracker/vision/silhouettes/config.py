"""Settings of the tracker of silhouettes. The name of a class is its YAML tag."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting
from drake_tracker.vision.config import CameraMotion, Contrast
from drake_tracker.vision.silhouettes.target_config import TARGETS, First


@dataclass(frozen=True)
class Silhouettes(Contrast):
    """Finds whole objects: the difference from a picture of the empty scene, which is learned from the images."""

    join_distance: int = setting(
        25, "gap between moving edges that is bridged until the background is known", "px", (1, 255)
    )


@dataclass(frozen=True)
class SilhouetteTracker:
    """Tracks several objects, moving or standing, by their silhouettes."""

    target: TARGETS.union() = setting(  # type: ignore[valid-type]
        First, "which of the objects to follow", shared=True
    )
    silhouettes: Silhouettes = setting(Silhouettes, "how objects are separated from the still scene")
    camera_motion: CameraMotion = setting(CameraMotion, "how motion of a camera itself is found")
    min_pixels: int = setting(25, "pixels of the smallest object", "px", (1, 65536))
    max_length: float = setting(
        0.18, "length of the longest object; a longer silhouette shows several that touch", "m", (0.01, 100.0)
    )
    confirm_after: int = setting(5, "pairs of images after which a new track is confirmed", "", (1, 1000), shared=True)
    coast_time: float = setting(
        2.0, "time after which a track that is not seen is deleted", "s", (0.05, 60.0), shared=True
    )
    margin: ClassVar[float] = 0.05
    """Distance from the work volume up to which objects are tracked, and the images examined [m]; chosen."""
    largest_std: ClassVar[float] = 0.03
    """Largest standard deviation of a point that is used [m]; chosen."""
    update_cycles: int = setting(1, "time from one pair of images to the next", "cycles", (1, 30))
