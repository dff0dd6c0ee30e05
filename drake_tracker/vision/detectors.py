"""The registry of the motion detectors: which settings stand for which detector."""

from typing import Any

import numpy as np

from drake_tracker.core.kinds import Kinds
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.background_difference import BackgroundDifferenceDetector
from drake_tracker.vision.config import (
    BackgroundDifference,
    DetectorSettings,
    FrameDifference,
    NormalFlow,
    StaticThreshold,
)
from drake_tracker.vision.frame_difference import FrameDifferenceDetector
from drake_tracker.vision.motion_detector import MotionDetector
from drake_tracker.vision.normal_flow import NormalFlowDetector
from drake_tracker.vision.static_threshold import StaticThresholdDetector

DETECTORS: Kinds[MotionDetector] = Kinds(
    "detector",
    {
        NormalFlow: NormalFlowDetector,
        FrameDifference: FrameDifferenceDetector,
        BackgroundDifference: BackgroundDifferenceDetector,
        StaticThreshold: StaticThresholdDetector,
    },
)
"""Every motion detector of the package by its settings. `config.DetectorSettings` lists the settings alone; it is kept
apart because reading a scenario must not load OpenCV."""


def make_detector(
    settings: DetectorSettings,
    *,
    window: np.ndarray | None = None,
    image: np.ndarray | None = None,
    period: float = VISION_PERIOD,
) -> MotionDetector:
    """Returns the `MotionDetector` of its settings.

    Args:
        settings: such as ``NormalFlow()``.
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image.
        image: the scene without the object, uint8, RGB or grey; only `BackgroundDifference` needs it.
        period: time between consecutive images [s].

    Raises DrakeTrackerError when the settings are of no detector, or a value is outside its range.
    """
    context: dict[str, Any] = {"window": window, "image": image, "period": period}
    return DETECTORS.make(settings, **context)
