"""Builds the motion detector that a scenario, or an option, names by its tag."""

from dataclasses import asdict

import cv2

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.background_difference import BackgroundDifference, BackgroundDifferenceParameters
from drake_tracker.vision.frame_difference import FrameDifference, FrameDifferenceParameters
from drake_tracker.vision.normal_flow import NormalFlow
from drake_tracker.vision.normal_flow_parameters import NormalFlowParameters
from drake_tracker.vision.static_threshold import StaticThreshold, StaticThresholdParameters


def make_detector(settings, window=None, image=None, period=VISION_PERIOD):
    """Returns the motion detector of a dataclass of the scenarios (`NormalFlow`, `FrameDifference` and so on).

    Args:
        window: where to look, uint8 of the image's shape; None is everywhere.
        image: the scene without the object, RGB, for `BackgroundDifference`.
        period: time between images [s].
    """
    kind, values = type(settings).__name__, asdict(settings)
    if kind == "NormalFlow":
        return NormalFlow(normal_flow_parameters(settings, period), window=window)
    if kind == "BackgroundDifference":
        background = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        return BackgroundDifference(background, BackgroundDifferenceParameters(**values), window)
    if kind == "StaticThreshold":
        return StaticThreshold(StaticThresholdParameters(**values), window)
    return FrameDifference(FrameDifferenceParameters(**values), window)


def normal_flow_parameters(settings, period=VISION_PERIOD):
    """Returns the `NormalFlowParameters` of the scenarios' `NormalFlow`: its preset, and what differs from it."""
    values = asdict(settings)
    return NormalFlowParameters.preset(values.pop("preset"), **values, period=period)
