"""Quantities that depend on the unit of length: the largest gap between two rays, and the estimator."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.diagrams.parts import estimator_of
from drake_tracker.estimation.bouncing import noticing_bounces
from drake_tracker.estimation.config import CoordinatedTurn
from drake_tracker.estimation.estimator import ESTIMATORS, SURFACE_ESTIMATORS, Estimator
from drake_tracker.estimation.unit_free import UnitFreeEstimator
from drake_tracker.scenarios.base import Custom

ESTIMATOR_SETTINGS = CoordinatedTurn | ESTIMATORS.union(Custom, without=SURFACE_ESTIMATORS)
"""Settings of the estimators that ``--estimator`` may name."""
GAP_PIXELS = 16.0
"""Largest gap between two rays: what so many pixels of the left image cover where the cameras look."""
PARALLEL = 0.05
"""Angle between the optical axes below which they count as parallel [rad]."""
FAR = 10.0
"""Distance at which parallel cameras look, in distances between them."""
READY_AFTER = 0.2
"""Time of points from which on the path is predicted, with default settings [s]."""


def usual_gap(cameras: Sequence[CameraModel]) -> float:
    """Returns the largest gap between the two rays of one point, in the unit of the calibration.

    Args:
        cameras: left and right.
    """
    left, right = cameras
    base = right.X_WC[:3, 3] - left.X_WC[:3, 3]
    axes = [camera.X_WC[:3, 2] for camera in cameras]
    cosine = float(axes[0] @ axes[1])
    distance = FAR * float(np.linalg.norm(base))
    if np.arccos(np.clip(cosine, -1.0, 1.0)) > PARALLEL:
        # Where the axes come closest to each other, if that is in front of the left camera.
        nearest = float((axes[0] - cosine * axes[1]) @ base) / (1.0 - cosine**2)
        if nearest > 0.0:
            distance = min(distance, nearest)
    return GAP_PIXELS * distance / float(left.K[0, 0])


def own_estimator(settings: Any, period: float, in_pixels: bool = False) -> Estimator[Any]:
    """Returns the estimator of a track.

    With default settings it suits any unit of length (`UnitFreeEstimator`). As soon as one setting is given, all
    settings hold as they are, in metres. In pixels, an estimator is always scaled, unless it is a custom one: the
    settings then hold for an object that moves with `unit_free.SPEED`.

    Args:
        settings: of an estimator, see `estimator_of`.
        period: of the images [s].
        in_pixels: whether points are in pixels.
    """
    if not is_scaled(settings, in_pixels):
        return estimator_of(settings, "--estimator", period=period)
    if settings == CoordinatedTurn():
        settings = replace(settings, ready_after=READY_AFTER)
    return UnitFreeEstimator(noticing_bounces(estimator_of(settings, "--estimator", period=period)))


def is_scaled(settings: Any, in_pixels: bool = False) -> bool:
    """Returns whether the unit of length is found from the points: for each kind with default settings or in pixels.

    Args:
        settings: of an estimator.
        in_pixels: whether points are in pixels.
    """
    return not isinstance(settings, Custom) and (in_pixels or bool(settings == type(settings)()))
