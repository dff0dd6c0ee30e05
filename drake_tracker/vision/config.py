"""Settings of the motion detectors and of the tracker. The name of a class is its YAML tag.

A settings dataclass is also what a detector is constructed with, and the only source of its defaults. Values are
checked when the detector is constructed, not here, so that a reader of scenario files can report all errors of a file
at once.
"""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, ClassVar

from drake_tracker.core.setting import setting
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.silhouettes.target_config import TARGETS, First

if TYPE_CHECKING:
    from drake_tracker.vision.centroid.normal_flow_parameters import NormalFlowParameters


@dataclass(frozen=True)
class NormalFlow:
    """The motion detector of section 3.1: normal flow, threshold, centroid. An empty value is the preset's own."""

    preset: str = setting("scaled", "set of values", choices=("scaled", "paper_literal", "paper_interlaced"))
    centroid: str = setting("hull", "mean of the moving pixels, or of their convex hull", choices=("mean", "hull"))
    path: str = setting("integer", "arithmetic", choices=("integer", "float"))
    stride: int | None = setting(None, "cycles between the images used", "cycles", (1, 4))
    threshold_px: float | None = setting(None, "normal flow that counts as motion", "px", (0.01, 100.0))
    threshold_window_s: ClassVar[float | None] = None
    """Time in which the threshold is measured [s]; chosen."""
    difference_gate: ClassVar[float | None] = None
    """Least temporal difference [grey levels]; chosen."""
    noise_factor: float | None = setting(
        None, "raises the gate to this many standard deviations of the noise", "", (0.0, 50.0)
    )
    normalise_gain: bool | None = setting(None, "compensate for changes of the whole image's brightness")
    denominator_floor: ClassVar[float | None] = None
    """Least gradient used [grey levels/px]; chosen."""
    norm: str | None = setting(None, "norm of the gradient", choices=("l1", "l2"))
    smoothing_size: int | None = setting(None, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: ClassVar[float | None] = None
    """Standard deviation of the Gaussian [px]; chosen."""
    min_pixels: int | None = setting(None, "moving pixels that make a valid centroid", "px", (1, 65536))
    join_distance: int | None = setting(None, "gap across which the hull joins edges", "px", (1, 512))
    brightness_gate: bool | None = setting(None, "drop moving pixels never brighter than the background: shadows")

    def resolve(self, period: float = VISION_PERIOD) -> "NormalFlowParameters":
        """Returns the `NormalFlowParameters`: the values of the preset, replaced by every setting that is not empty.

        Args:
            period: time between consecutive images [s].

        Raises DrakeTrackerError on a value outside its range.
        """
        from drake_tracker.vision.centroid.normal_flow_parameters import PRESETS, NormalFlowParameters
        from drake_tracker.vision.check_settings import check_settings

        check_settings(self, "normal flow")
        values = {name: value for name, value in asdict(self).items() if value is not None}
        preset = values.pop("preset")
        return NormalFlowParameters(**{**PRESETS[preset], **values}, period=period)


@dataclass(frozen=True)
class BinaryImage:
    """What all detectors share that threshold a single binary image."""

    smoothing_size: int = setting(3, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: ClassVar[float] = 1.0
    """Standard deviation of the Gaussian [px]; chosen."""
    min_pixels: int = setting(6, "white pixels that make a valid centroid", "px", (1, 65536))
    centroid: str = setting("hull", "mean of the white pixels, or of their convex hull", choices=("mean", "hull"))
    join_distance: int = setting(12, "gap across which the hull joins fragments", "px", (1, 512))


@dataclass(frozen=True)
class FrameDifference(BinaryImage):
    """The difference of two images of the sequence: the method that the paper chose."""

    stride: int = setting(
        2, "cycles between the two images; 2 for interlaced images, 1 for every image", "cycles", (1, 4)
    )
    threshold: float = setting(5.0, "change that counts as motion", "grey levels", (1.0, 255.0))
    normalise_gain: bool = setting(True, "compensate for changes of the whole image's brightness; the paper does not")


@dataclass(frozen=True)
class BackgroundDifference(BinaryImage):
    """The difference from an image without the ball, taken with the gate open: the paper dropped it."""

    threshold: float = setting(5.0, "difference that counts as the ball", "grey levels", (1.0, 255.0))


@dataclass(frozen=True)
class StaticThreshold(BinaryImage):
    """A plain threshold of the image: cannot find white on white, as the paper says."""

    level: float = setting(200.0, "brightness above which a pixel counts as the ball", "grey levels", (0.0, 255.0))


@dataclass(frozen=True)
class Contrast:
    """What counts as an object in the difference from the empty scene, and what as its shadow."""

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
class Silhouettes(Contrast):
    """Finds whole objects: the difference from a picture of the empty scene, which is learned from the images."""

    join_distance: int = setting(
        25, "gap between moving edges that is bridged until the background is known", "px", (1, 255)
    )


@dataclass(frozen=True)
class CameraMotion:
    """What counts as motion of the camera itself, and which images cannot be aligned."""

    still: float = setting(0.15, "displacement up to which the camera counts as still", "px", (0.01, 2.0))
    largest_std: ClassVar[float] = 0.2
    """Largest expected error of a displacement [px]; chosen."""
    least_overlap: ClassVar[float] = 0.4
    """Least share of the reference's edges within an image; chosen."""
    rebuild_overlap: ClassVar[float] = 0.75
    """Share below which the reference should be replaced; chosen."""
    steadiness: ClassVar[float] = 0.3
    """Displacement between images of a camera that stays displaced [px]; chosen."""
    steady_images: ClassVar[int] = 30
    """Images after which the camera counts as displaced for good; chosen."""
    largest_side: ClassVar[int] = 480
    """Longer side above which an image is used at lower resolution [px]; chosen."""


@dataclass(frozen=True)
class MotionCentroid:
    """The paper's way: one centroid of all that moves in each image, and one point."""

    detector: NormalFlow = setting(NormalFlow, "the motion detector")


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
    largest_std: ClassVar[float] = 0.03
    """Largest standard deviation of a point that is used [m]; chosen."""
    mask_arm: bool = setting(True, "ignore the pixels where the robot's own arm is, as its joint angles tell")


@dataclass(frozen=True)
class OneObject:
    """Measured vision sees the first train only."""


@dataclass(frozen=True)
class SeveralObjects:
    """Measured vision sees all objects."""

    target: TARGETS.union() = setting(  # type: ignore[valid-type]
        First, "which of the objects to follow", shared=True
    )
    confirm_after: int = setting(5, "cycles after which a new track is confirmed", "", (1, 1000), shared=True)
    coast_time: float = setting(
        2.0, "time after which a track that is not seen is deleted", "s", (0.05, 60.0), shared=True
    )


@dataclass(frozen=True)
class MeasuredParts:
    """Vision of the parts on a belt without images: their true poses plus random errors.

    The defaults are the errors of the vision with cameras (`tasks.conveyor.vision_errors`), on seeds 5 and 21 to 24.
    """

    noise_std: ClassVar[float] = 0.0003
    """Standard deviation of the position that changes in every cycle [m]; measured, see above."""
    bias_std: ClassVar[float] = 0.00025
    """Standard deviation of the position that each part keeps [m]; measured, see above."""
    turn_noise_std_deg: ClassVar[float] = 1.0
    """Standard deviation of the direction that changes in every cycle [deg]; measured, see above."""
    turn_bias_std_deg: ClassVar[float] = 0.8
    """Standard deviation of the direction that each part keeps [deg]; measured, see above."""
    lag_cycles: int = setting(
        15, "time from the capture of an image to the parts in it", "cycles", (0, 120), shared=True
    )


@dataclass(frozen=True)
class BeltParts(Contrast):
    """Finds the parts on a moving belt: what stands out from the empty belt, and has the outline of a part."""

    largest_misfit: ClassVar[float] = 0.03
    """Mean square of the difference between silhouette and outline up to which a new part is one; a known part may
    have twice as much; chosen."""
    confirm_after: int = setting(8, "pairs of images after which a new part is reported", "", (1, 1000))
    coast_time: float = setting(3.0, "time after which a part that the arm hides is forgotten", "s", (0.05, 60.0))
    lost_after: ClassVar[float] = 0.3
    """Time after which a part that is not where it should be is forgotten [s]; chosen."""
    mask_arm: bool = setting(True, "ignore the pixels where the robot's own arm is, as its joint angles tell")
