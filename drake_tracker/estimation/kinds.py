"""The registry of the estimators."""

from typing import TYPE_CHECKING, Any

from drake_tracker.core.registry import Registry
from drake_tracker.estimation.config import AlphaBetaGamma, ArcLength, ClosedPath, CoordinatedTurn, Slope

if TYPE_CHECKING:
    from drake_tracker.estimation.estimator import Estimator

ESTIMATORS: "Registry[Estimator[Any]]" = Registry(
    "estimator",
    {
        ClosedPath: "drake_tracker.estimation.closed_path:ClosedPathEstimator",
        CoordinatedTurn: "drake_tracker.estimation.coordinated_turn:CoordinatedTurnEstimator",
        ArcLength: "drake_tracker.estimation.arc_length:ArcLengthEstimator",
        AlphaBetaGamma: "drake_tracker.estimation.alpha_beta_gamma:AlphaBetaGammaEstimator",
        Slope: "drake_tracker.estimation.inclined_plane:InclinedPlaneEstimator",
    },
)
"""Every estimator of the package by its settings; the one place where an estimator is registered."""
SURFACE_ESTIMATORS = (Slope,)
"""Estimators that need the pose of a surface. All others predict any object on any path."""


def make_estimator(kind: Any, **parameters: Any) -> "Estimator[Any]":
    """Returns an estimator.

    Args:
        kind: the name of a kind, such as "closed_path", or an instance of its settings, such as ``ClosedPath()``.
        **parameters: with a name, settings of this kind and other keyword arguments of its class, such as ``period``.
            With settings, keyword arguments only; those that this kind does not take are ignored.

    Raises:
        DrakeTrackerError: the kind or a parameter is unknown, or a value is out of range.
    """
    if type(kind) in ESTIMATORS.makers:
        return ESTIMATORS.make(kind, **parameters)
    return ESTIMATORS.make_by_name(kind, **parameters)
