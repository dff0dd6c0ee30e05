"""The registry of the estimators."""

from typing import Any

from drake_tracker.core.kinds import Kinds
from drake_tracker.estimation.arc_length import ArcLengthEstimator
from drake_tracker.estimation.cartesian import AlphaBetaGammaEstimator
from drake_tracker.estimation.closed_path import ClosedPathEstimator
from drake_tracker.estimation.config import AlphaBetaGamma, ArcLength, ClosedPath, CoordinatedTurn, Slope
from drake_tracker.estimation.coordinated_turn import CoordinatedTurnEstimator
from drake_tracker.estimation.estimator import Estimator
from drake_tracker.estimation.slope import SlopeEstimator

ESTIMATORS: Kinds[Estimator[Any]] = Kinds(
    "estimator",
    {
        ClosedPath: ClosedPathEstimator,
        CoordinatedTurn: CoordinatedTurnEstimator,
        ArcLength: ArcLengthEstimator,
        AlphaBetaGamma: AlphaBetaGammaEstimator,
        Slope: SlopeEstimator,
    },
)
"""Every estimator of the package by its settings. `config.PathEstimator` lists those that a scenario of the train and
`drake-tracker track` offer; it is kept apart because reading a scenario must not load the estimators."""


def make_estimator(kind: Any, **parameters: Any) -> Estimator[Any]:
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
