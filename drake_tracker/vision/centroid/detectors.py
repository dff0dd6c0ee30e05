"""The registry of the motion detectors."""

from typing import TYPE_CHECKING, Any

from drake_tracker.core.registry import Registry
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.centroid.config import BackgroundDifference, FrameDifference, NormalFlow, StaticThreshold

if TYPE_CHECKING:
    import numpy as np

    from drake_tracker.vision.centroid.motion_detector import MotionDetector

DETECTORS: "Registry[MotionDetector]" = Registry(
    "detector",
    {
        FrameDifference: "drake_tracker.vision.centroid.frame_difference:FrameDifferenceDetector",
        NormalFlow: "drake_tracker.vision.centroid.normal_flow:NormalFlowDetector",
        BackgroundDifference: "drake_tracker.vision.centroid.background_difference:BackgroundDifferenceDetector",
        StaticThreshold: "drake_tracker.vision.centroid.static_threshold:StaticThresholdDetector",
    },
)
"""Every motion detector of the package by its settings; the one place where a detector is registered."""
SCENE_DETECTORS = (BackgroundDifference, StaticThreshold)
"""Detectors that need an image of the empty scene or the brightness of the object. All others need only the images."""


def make_detector(
    settings: Any,
    *,
    window: "np.ndarray | None" = None,
    image: "np.ndarray | None" = None,
    period: float = VISION_PERIOD,
) -> "MotionDetector":
    """Returns the `MotionDetector` of its settings.

    Args:
        settings: settings of a kind in `DETECTORS`, such as ``NormalFlow()``.
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image.
        image: the scene without the object, uint8, RGB or grey; only `BackgroundDifference` needs it.
        period: time between consecutive images [s].

    Raises DrakeTrackerError when the settings are of no detector, or a value is outside its range.
    """
    context: dict[str, Any] = {"window": window, "image": image, "period": period}
    return DETECTORS.make(settings, **context)
