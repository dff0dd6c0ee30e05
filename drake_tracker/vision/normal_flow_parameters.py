"""Settings of the normal-flow detector, and the presets that document how the 1991 text can be read."""

import math
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD


@dataclass(frozen=True)
class NormalFlowParameters:
    """Settings of `NormalFlow`; the defaults are the preset ``scaled``.

    Attributes:
        stride: cycles between the images used: 1 for consecutive ones, 2 for every other.
        threshold_px, threshold_window_s: a pixel moves when its normal velocity reaches threshold_px per
            threshold_window_s [s].
        difference_gate: least |I_t| of a moving pixel [grey].
        noise_factor: raises the gate to this many standard deviations of I_t, measured in each image by the median
            absolute difference; 0 leaves the gate alone.
        normalise_gain: scales I0 to the mean brightness of I2 first, so that flickering light does not move.
        denominator_floor: least |I_x| + |I_y| used [grey/px].
        norm: of the gradient, "l1" (the paper's arithmetic) or "l2" (its equation 3).
        smoothing_size, smoothing_sigma: Gaussian mask, odd side [px] and standard deviation [px].
        min_pixels: fewer moving pixels make no centroid.
        centroid: "mean" (the paper's) or "hull" (of the largest moving region).
        join_distance: gap [px] across which the hull joins edges of one object: long enough for the gap between the
            ends of a plain body, short enough not to reach other things that move.
        brightness_gate: drop moving pixels that are no brighter than the background (cast shadows).
        path: "integer", or "float", which divides as the text does and serves as its oracle.
        period: time between images [s].

    Raises DrakeTrackerError on a value outside its range.
    """

    stride: int = 2
    threshold_px: float = 0.5
    threshold_window_s: float = 4 * VISION_PERIOD
    difference_gate: float = 6.0
    noise_factor: float = 5.0
    normalise_gain: bool = True
    denominator_floor: float = 1.0
    norm: str = "l1"
    smoothing_size: int = 5
    smoothing_sigma: float = 1.0
    min_pixels: int = 12
    centroid: str = "hull"
    join_distance: int = 24
    brightness_gate: bool = False
    path: str = "integer"
    period: float = VISION_PERIOD

    def __post_init__(self):
        for name, allowed in (("norm", ("l1", "l2")), ("centroid", ("mean", "hull")), ("path", ("integer", "float"))):
            if getattr(self, name) not in allowed:
                raise DrakeTrackerError(
                    f"normal flow: {name} is {getattr(self, name)!r}; it must be one of {', '.join(allowed)}"
                )
        for name, least, unit in (
            ("stride", 1, "cycles"),
            ("threshold_px", 1e-3, "px"),
            ("threshold_window_s", 1e-3, "s"),
            ("difference_gate", 0, "grey levels"),
            ("noise_factor", 0, "standard deviations"),
            ("denominator_floor", 0.1, "grey levels per px"),
            ("smoothing_size", 1, "px"),
            ("smoothing_sigma", 0.1, "px"),
            ("min_pixels", 1, "px"),
            ("join_distance", 1, "px"),
            ("period", 1e-4, "s"),
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= least):
                raise DrakeTrackerError(f"normal flow: {name} is {value}; it must be at least {least} {unit}")
        for name in ("stride", "smoothing_size", "min_pixels", "join_distance"):
            if getattr(self, name) != int(getattr(self, name)):
                raise DrakeTrackerError(f"normal flow: {name} is {getattr(self, name)}; it must be a whole number")
        if self.smoothing_size % 2 == 0:
            raise DrakeTrackerError(f"normal flow: smoothing_size is {self.smoothing_size} px; it must be odd")

    @classmethod
    def preset(cls, name, **overrides):
        """Returns a preset by name, with every override that is not None put in its place.

        ``paper_literal`` and ``paper_interlaced`` take the paper at its word: 10 px per 60 ms and no other guard, on
        consecutive images and on images every other cycle. Raises DrakeTrackerError on an unknown name or override.
        """
        if name not in PRESETS:
            raise DrakeTrackerError(f"normal flow: preset is {name!r}; it must be one of {', '.join(PRESETS)}")
        known = {field.name for field in fields(cls)}
        for key in overrides:
            if key not in known:
                raise DrakeTrackerError(f"normal flow: unknown setting {key!r}; known are {', '.join(sorted(known))}")
        return replace(PRESETS[name], **{key: value for key, value in overrides.items() if value is not None})

    @property
    def span(self):
        """Time between I0 and I2 [s]."""
        return 2 * self.stride * self.period

    @property
    def displacement_threshold(self):
        """The velocity threshold as a displacement between I0 and I2 [px]."""
        return self.threshold_px * self.span / self.threshold_window_s

    def smallest_visible_speed(self, contrast=200.0):
        """Returns the least image speed [px/s] at which an edge of ``contrast`` [grey] yields any moving pixel.

        The edge is straight, along a row or a column of pixels, and moves square to itself. It passes the threshold
        on its flanks before it does in its middle: there the gradient has faded while the difference has not, so that
        the least speed can be well below the threshold's own. Below the returned speed such an edge shows nothing, and
        a softer one neither. Infinity when no speed is enough.
        """
        half = int(self.smoothing_size) // 2
        kernel = cv2.getGaussianKernel(int(self.smoothing_size), self.smoothing_sigma)
        x = np.arange(0.0, half + 2.0, 0.05)

        def edge(distance):
            """Smoothed brightness of a pixel at a distance from the edge."""
            covered = np.clip(0.5 - (distance + np.arange(-half, half + 1)[:, None]), 0.0, 1.0)
            return contrast * (kernel * covered).sum(axis=0)

        slope = (edge(x - 1.0) - edge(x + 1.0)) / 2.0
        limit = self.displacement_threshold * np.maximum(slope, self.denominator_floor)
        limit = np.maximum(limit, self.difference_gate)

        def visible(displacement):
            return (edge(x - displacement / 2) - edge(x + displacement / 2) >= limit).any()

        low, high = 0.0, 4.0 * (half + 2.0)
        if not visible(high):
            return math.inf
        while high - low > 1e-4:
            middle = (low + high) / 2
            low, high = (low, middle) if visible(middle) else (middle, high)
        return high / self.span


_PAPER = NormalFlowParameters(
    stride=1,
    threshold_px=10.0,
    threshold_window_s=0.060,
    difference_gate=0.0,
    noise_factor=0.0,
    normalise_gain=False,
    centroid="mean",
)
PRESETS = {
    "scaled": NormalFlowParameters(),
    "paper_literal": _PAPER,
    "paper_interlaced": replace(_PAPER, stride=2),
}
