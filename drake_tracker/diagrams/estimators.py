"""Builds the estimator that a scenario, or an option, names by its tag."""

from dataclasses import asdict

from drake_tracker.diagrams.custom import make_custom
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.check import check_estimator
from drake_tracker.scenarios.base import Custom

KINDS = {
    "ArcLength": "arc_length",
    "AlphaBetaGamma": "alpha_beta_gamma",
    "CoordinatedTurn": "coordinated_turn",
    "ClosedPath": "closed_path",
}
"""From tag to kind of `drake_tracker.estimation.ESTIMATORS`."""


def estimator_of(settings, where="estimator", period=None):
    """Returns the estimator of a dataclass of the scenarios (`ClosedPath`, `Custom` and so on).

    Args:
        where: the settings stand, for messages.
        period: time between points [s], when it is not that of the simulated cameras.

    Raises DrakeTrackerError, one line, when the user's own cannot be made or is no estimator.
    """
    if isinstance(settings, Custom):
        estimator = make_custom(settings, where)
        check_estimator(estimator, f"{where}: {settings.call}")
        return estimator
    kind, values = KINDS[type(settings).__name__], asdict(settings)
    if period is not None and kind in ("arc_length", "alpha_beta_gamma"):
        values["period"] = period
    return make_estimator(kind, **values)
