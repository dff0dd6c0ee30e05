"""Settings that several methods of vision share."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class Contrast:
    """Criteria for objects, and for their shadows, in the difference from the empty scene."""

    threshold: float = setting(10.0, "least difference from the background that counts", "grey levels", (1.0, 255.0))
    noise_factor: ClassVar[float] = 5.0
    """Raises the threshold to this many standard deviations of the noise; chosen."""
    learning_rate: ClassVar[float] = 0.02
    """Share of each image in the background; chosen."""
    shadow_darkest: ClassVar[float] = 0.25
    """Least brightness of a shadow, as a share of the background's; chosen."""
    shadow_lightest: ClassVar[float] = 0.97
    """Largest brightness of a shadow, as such a share; chosen."""
    shadow_spread: ClassVar[float] = 0.22
    """Largest change of colour in a shadow, 0: no test for shadows; chosen."""
    body_share: ClassVar[float] = 0.25
    """Share of a region that is not shadow-like from which on the rest counts as its shadow; chosen."""


@dataclass(frozen=True)
class CameraMotion:
    """Criteria for motion of the camera itself, and for images that cannot be aligned."""

    still: float = setting(0.15, "displacement up to which the camera counts as still", "px", (0.01, 2.0))
    largest_std: ClassVar[float] = 0.2
    """Largest expected error of a displacement [px]; chosen."""
    least_overlap: ClassVar[float] = 0.4
    """Least share of the reference's edges within an image; chosen."""
    rebuild_overlap: ClassVar[float] = 0.75
    """A former setting without effect, accepted at this value."""
    steadiness: ClassVar[float] = 0.3
    """Displacement between images of a camera that stays displaced [px]; chosen."""
    steady_images: ClassVar[int] = 30
    """Images after which the camera counts as displaced for good; chosen."""
    largest_side: ClassVar[int] = 480
    """Longer side above which an image is used at lower resolution [px]; chosen."""
