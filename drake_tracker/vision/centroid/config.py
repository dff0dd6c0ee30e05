"""Settings of the motion centroid and of its detectors. The name of a class is its YAML tag."""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, ClassVar

from drake_tracker.core.setting import setting
from drake_tracker.core.timing import VISION_PERIOD

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
    """Time in which the threshold is measured [s]; the preset's: 60 ms in section 3.1, or chosen."""
    difference_gate: ClassVar[float | None] = None
    """Least temporal difference [grey levels]; the preset's: none in the paper, or chosen."""
    noise_factor: float | None = setting(
        None, "raises the gate to this many standard deviations of the noise", "", (0.0, 50.0)
    )
    normalise_gain: bool | None = setting(None, "compensate for changes of the whole image's brightness")
    denominator_floor: ClassVar[float | None] = None
    """Least gradient used [grey levels/px]; the preset's, chosen."""
    norm: str | None = setting(None, "norm of the gradient", choices=("l1", "l2"))
    smoothing_size: int | None = setting(None, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: ClassVar[float | None] = None
    """Standard deviation of the Gaussian [px]; the preset's, chosen."""
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
    """Common settings of detectors that threshold a single image."""

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
class MotionCentroid:
    """The paper's way: one centroid of all that moves in each image, and one point."""

    detector: NormalFlow = setting(NormalFlow, "the motion detector")
