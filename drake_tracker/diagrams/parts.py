"""Makes the parts that a scenario names by their YAML tags, custom parts included."""

from typing import Any

from drake_tracker.core.timing import ESTIMATOR_SLOT, vision_slot
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.diagrams.custom import make_custom
from drake_tracker.estimation.check import check_estimator
from drake_tracker.estimation.estimator import Estimator
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.estimation.kinds import make_estimator
from drake_tracker.scenarios.base import Custom


def estimator_of(settings: Any, where: str = "estimator", **context: Any) -> Estimator:
    """Returns the estimator of its settings.

    Args:
        settings: settings of a kind in `drake_tracker.estimation.kinds`, or a `Custom`.
        where: place of the settings, for messages.
        **context: what the kind needs besides, such as ``period``: time between points [s].

    Raises DrakeTrackerError, one line, when a custom estimator cannot be made or does not satisfy the `Estimator`
    Protocol.
    """
    if isinstance(settings, Custom):
        estimator = make_custom(settings, where)
        check_estimator(estimator, f"{where}: {settings.call}")
        return estimator
    return make_estimator(settings, **context)


def make_host(estimator: Estimator, time_step: float) -> EstimatorSystem:
    """Returns the host subsystem: an estimator as a System named "host", in its slot of a plant step [s]."""
    host = EstimatorSystem(estimator, offset=vision_slot(ESTIMATOR_SLOT, time_step))
    host.set_name("host")
    return host


def check_custom_parts(scenario: Any) -> None:
    """Makes the custom parts of a scenario once, to find mistakes in them before a long job starts.

    Args:
        scenario: a scenario of any task.

    Raises DrakeTrackerError, one line, when one of them cannot be used.
    """
    if isinstance(scenario.estimator, Custom):
        estimator_of(scenario.estimator, scenario.where("estimator"))
    if isinstance(scenario.arm, Custom):
        arm_of(scenario)
