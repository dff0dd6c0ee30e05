"""Settings of the motion detectors. The name of a class is its YAML tag."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class NormalFlow:
    """The motion detector of section 3.1: normal flow, threshold, centroid. An empty value is the preset's own."""

    preset: str = setting("scaled", "set of values", choices=("scaled", "paper_literal", "paper_interlaced"))
    centroid: str = setting("hull", "mean of the moving pixels, or of their convex hull", choices=("mean", "hull"))
    path: str = setting("integer", "arithmetic", choices=("integer", "float"))
    stride: int | None = setting(None, "cycles between the images used", "cycles", (1, 4))
    threshold_px: float | None = setting(None, "normal flow that counts as motion", "px", (0.01, 100.0))
    threshold_window_s: float | None = setting(None, "time in which it is measured", "s", (0.001, 1.0))
    difference_gate: float | None = setting(None, "least temporal difference", "grey levels", (0.0, 255.0))
    noise_factor: float | None = setting(None, "raises it to so many deviations of the noise", "", (0.0, 50.0))
    normalise_gain: bool | None = setting(None, "take out changes of the whole image's brightness")
    denominator_floor: float | None = setting(None, "least gradient used", "grey levels/px", (0.0, 255.0))
    norm: str | None = setting(None, "norm of the gradient", choices=("l1", "l2"))
    smoothing_size: int | None = setting(None, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: float | None = setting(None, "standard deviation of the Gaussian", "px", (0.1, 10.0))
    min_pixels: int | None = setting(None, "moving pixels that make a valid centroid", "px", (1, 65536))
    join_distance: int | None = setting(None, "gap across which the hull joins edges", "px", (1, 512))
    brightness_gate: bool | None = setting(None, "drop moving pixels never brighter than the background: shadows")


@dataclass(frozen=True)
class BinaryImage:
    """What all detectors share that make a binary image."""

    smoothing_size: int = setting(3, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: float = setting(1.0, "standard deviation of the Gaussian", "px", (0.1, 10.0))
    min_pixels: int = setting(6, "white pixels that make a valid centroid", "px", (1, 65536))
    centroid: str = setting("hull", "mean of the white pixels, or of their convex hull", choices=("mean", "hull"))
    join_distance: int = setting(12, "gap across which the hull joins fragments", "px", (1, 512))


@dataclass(frozen=True)
class FrameDifference(BinaryImage):
    """Two consecutive images subtracted: the method that the paper chose."""

    stride: int = setting(2, "cycles between the two images; 2 as interlaced, 1 every one", "cycles", (1, 4))
    threshold: float = setting(5.0, "change that counts as motion", "grey levels", (1.0, 255.0))
    normalise_gain: bool = setting(True, "take out changes of the whole image's brightness; the paper does not")


@dataclass(frozen=True)
class BackgroundDifference(BinaryImage):
    """The difference from an image without the ball, taken with the gate open: the paper dropped it."""

    threshold: float = setting(5.0, "difference that counts as the ball", "grey levels", (1.0, 255.0))


@dataclass(frozen=True)
class StaticThreshold(BinaryImage):
    """A plain threshold of the image: cannot find white on white, as the paper says."""

    level: float = setting(200.0, "pixels that are brighter are taken for the ball", "grey levels", (0.0, 255.0))
