"""The resolved parameters of the normal-flow detector, and the presets: how the 1991 text can be read."""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.check_settings import check_odd

LEAST_FLOOR = 0.1
"""Least denominator floor [grey levels/px]: below it, a pixel without gradient and with any noise would move."""
_SCALED: dict[str, Any] = {
    "stride": 2,
    "threshold_px": 0.5,
    "threshold_window_s": 4 * VISION_PERIOD,
    "difference_gate": 6.0,
    "noise_factor": 5.0,
    "normalise_gain": True,
    "denominator_floor": 1.0,
    "norm": "l1",
    "smoothing_size": 5,
    "smoothing_sigma": 1.0,
    "min_pixels": 12,
    "join_distance": 24,
    "brightness_gate": False,
}
_PAPER = _SCALED | {
    "stride": 1,
    "threshold_px": 10.0,
    "threshold_window_s": 0.060,
    "difference_gate": 0.0,
    "noise_factor": 0.0,
    "normalise_gain": False,
}
PRESETS = {"scaled": _SCALED, "paper_literal": _PAPER, "paper_interlaced": _PAPER | {"stride": 2}}
"""{preset: values of the parameters that `NormalFlow` leaves empty}.

``paper_literal`` and ``paper_interlaced`` take the paper at its word, 10 px per 60 ms and no other guard, on
consecutive images and on every other image. The paper's centroid is the ``mean``, which is a separate setting.
"""


@dataclass(frozen=True)
class NormalFlowParameters:
    """What `NormalFlowDetector` computes with; `NormalFlow.resolve` makes it.

    Attributes:
        stride: cycles between the images used: 1 for consecutive ones, 2 for every other.
        threshold_px: a pixel moves when its normal velocity reaches this distance [px] per ``threshold_window_s``.
        threshold_window_s: time in which the threshold is measured [s].
        difference_gate: least |I_t| of a moving pixel [grey].
        noise_factor: raises the gate to this many standard deviations of I_t, measured in each image by the median
            absolute difference; 0 leaves the gate unchanged.
        normalise_gain: scales I0 to the mean brightness of I2 first, so that flickering light does not move.
        denominator_floor: least |I_x| + |I_y| used [grey/px].
        norm: of the gradient, "l1" (the paper's arithmetic) or "l2" (its equation 3).
        smoothing_size: side of the Gaussian mask [px], odd.
        smoothing_sigma: standard deviation of the Gaussian [px].
        min_pixels: least number of moving pixels that make a centroid.
        centroid: "mean" (the paper's) or "hull" (of the largest moving region).
        join_distance: gap [px] across which the hull joins edges of one object: long enough for the gap between the
            ends of an untextured body, short enough not to reach other moving objects.
        brightness_gate: drop moving pixels that are no brighter than the background (cast shadows).
        path: "integer", or "float", which divides as the text does and is the reference for the integer path.
        period: time between consecutive images [s].

    Raises DrakeTrackerError on an even mask, a denominator floor below `LEAST_FLOOR`, or a period of 0.
    """

    stride: int
    threshold_px: float
    threshold_window_s: float
    difference_gate: float
    noise_factor: float
    normalise_gain: bool
    denominator_floor: float
    norm: str
    smoothing_size: int
    smoothing_sigma: float
    min_pixels: int
    centroid: str
    join_distance: int
    brightness_gate: bool
    path: str
    period: float

    def __post_init__(self) -> None:
        check_odd(self.smoothing_size, "normal flow")
        for name, least, unit in (("denominator_floor", LEAST_FLOOR, "grey levels/px"), ("period", 1e-4, "s")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= least):
                raise DrakeTrackerError(f"normal flow: {name} is {value}; it must be at least {least:g} {unit}")

    @property
    def span(self) -> float:
        """Time between I0 and I2 [s]."""
        return 2 * self.stride * self.period

    @property
    def displacement_threshold(self) -> float:
        """The velocity threshold as a displacement between I0 and I2 [px]."""
        return self.threshold_px * self.span / self.threshold_window_s

    def smallest_visible_speed(self, contrast: float = 200.0) -> float:
        """Returns the least image speed [px/s] at which an edge yields any moving pixel; infinity when none does.

        The edge is straight, along a row or a column of pixels, and moves perpendicular to itself. Its flanks pass the
        threshold before its centre: at the flanks the gradient has faded while the difference has not, so that the
        least speed can be well below the threshold itself. Below the returned speed, neither this edge nor a softer
        edge yields a moving pixel.

        Args:
            contrast: step of brightness across the edge [grey].
        """
        half = int(self.smoothing_size) // 2
        kernel = cv2.getGaussianKernel(int(self.smoothing_size), self.smoothing_sigma)
        x = np.arange(0.0, half + 2.0, 0.05)

        def edge(distance: np.ndarray) -> np.ndarray:
            """Smoothed brightness of a pixel at a distance from the edge."""
            covered = np.clip(0.5 - (distance + np.arange(-half, half + 1)[:, None]), 0.0, 1.0)
            return contrast * (kernel * covered).sum(axis=0)

        slope = (edge(x - 1.0) - edge(x + 1.0)) / 2.0
        limit = self.displacement_threshold * np.maximum(slope, self.denominator_floor)
        limit = np.maximum(limit, self.difference_gate)

        def visible(displacement: float) -> bool:
            return bool((edge(x - displacement / 2) - edge(x + displacement / 2) >= limit).any())

        low, high = 0.0, 4.0 * (half + 2.0)
        if not visible(high):
            return math.inf
        while high - low > 1e-4:
            middle = (low + high) / 2
            low, high = (low, middle) if visible(middle) else (middle, high)
        return high / self.span
