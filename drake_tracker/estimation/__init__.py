"""The host computer: filters the triangulated points and predicts the path ahead.

An estimator is functional: ``initial_state()``, ``update(state, stamp, p_WQ) -> state`` (``p_WQ=None``: no valid
point), ``ready(state) -> bool``, ``predict(state, times) -> (n, 4)`` rows x, y, z [m, W] and yaw [rad] at absolute
times [s], and ``predict_std(state, times) -> (n,)`` [m].  A state is a frozen dataclass with ``stamp``, the capture
time [s] of the newest point in it.
"""

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation.arc_length import ArcLength
from drake_tracker.estimation.cartesian import AlphaBetaGamma
from drake_tracker.estimation.closed_path import ClosedPath
from drake_tracker.estimation.coordinated_turn import CoordinatedTurn
from drake_tracker.estimation.parameters import build
from drake_tracker.estimation.slope import Slope

ESTIMATORS = {
    "arc_length": ArcLength,
    "alpha_beta_gamma": AlphaBetaGamma,
    "coordinated_turn": CoordinatedTurn,
    "closed_path": ClosedPath,
    "slope": Slope,
}
"""The kinds of estimator by name."""


def make_estimator(kind, **parameters):
    """Returns an estimator of a kind in `ESTIMATORS`, built with its parameters.

    Raises DrakeTrackerError for an unknown kind or parameter, or a value out of range.
    """
    if not isinstance(kind, str) or kind not in ESTIMATORS:
        raise DrakeTrackerError(f"estimator: kind is {kind!r}; allowed are {', '.join(sorted(ESTIMATORS))}")
    return build(ESTIMATORS[kind], kind, parameters)
