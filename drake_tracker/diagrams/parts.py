"""Makes the parts that a scenario names by YAML tags, including custom parts: arm, estimator and link."""

from collections.abc import Sequence
from typing import Any

from drake_tracker.arm.arm_check import check_arm
from drake_tracker.arm.config import HandKind
from drake_tracker.arm.description import ArmDescription, make_arm
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Prediction
from drake_tracker.core.timing import ESTIMATOR_SLOT, vision_slot
from drake_tracker.diagrams.custom import make_custom
from drake_tracker.estimation.checked_estimator import CheckedEstimator
from drake_tracker.estimation.estimator import Estimator, check_estimator, make_estimator
from drake_tracker.estimation.estimator_bank_system import EstimatorBankSystem
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.faults.fault import Fault, HostFault, LinkFault, faults_at
from drake_tracker.link.link import Link
from drake_tracker.link.link_system import LinkSystem, make_link
from drake_tracker.scenarios.base import Custom

_HANDS = {HandKind.GRIPPER: "fingers", HandKind.CUP: "no fingers, but a cup"}


def arm_of(scenario: Any) -> ArmDescription:
    """Returns the description of a scenario's arm, with the hand that its task needs.

    Args:
        scenario: a scenario with the setting ``arm`` and the attribute ``hand`` (a `HandKind`).

    Raises DrakeTrackerError when a custom arm is not allowed (see `drake_tracker.scenarios.consent`), cannot be made,
    or does not have that hand.
    """
    if not isinstance(scenario.arm, Custom):
        return make_arm(scenario.arm, hand=scenario.hand)
    where = scenario.where("arm")
    arm = make_custom(scenario.arm, where, ArmDescription)
    if not isinstance(arm, ArmDescription):
        raise DrakeTrackerError(
            f"{where}: {scenario.arm.call} returned a {type(arm).__name__}; it must return an ArmDescription"
        )
    if arm.has_fingers != (scenario.hand is HandKind.GRIPPER):
        raise DrakeTrackerError(
            f"{where}: {scenario.arm.call}: for the {scenario.task} the hand must have {_HANDS[scenario.hand]}"
        )
    try:
        check_arm(arm)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(f"{where}: {scenario.arm.call}: {error}") from None
    return arm


def estimator_of(settings: Any, where: str = "estimator", **context: Any) -> Estimator:
    """Returns the estimator that settings describe.

    Args:
        settings: settings of a kind in `drake_tracker.estimation.estimator`, or a `Custom`.
        where: where the settings were written, for messages.
        **context: what the kind needs in addition, such as ``period``, the time between two points [s].

    Raises DrakeTrackerError when a custom estimator is not allowed (see `drake_tracker.scenarios.consent`), cannot be
    made, or does not satisfy the `Estimator` Protocol.
    """
    if isinstance(settings, Custom):
        estimator = make_custom(settings, where, Estimator)
        name = f"{where}: {settings.call}"
        check_estimator(estimator, name)
        return CheckedEstimator(estimator, name)
    return make_estimator(settings, **context)


def make_host(
    estimator: Estimator, time_step: float, faults: Sequence[Fault] = (), several: bool = False
) -> EstimatorSystem | EstimatorBankSystem:
    """Returns the host: an estimator as a System named "host", updated in the estimator's slot.

    Args:
        estimator: turns points into predicted paths.
        time_step: the plant's step, of which the slot is a fraction [s].
        faults: the injected faults, of which only faults of the host are used.
        several: whether vision tracks several objects, each of which has a separate estimator.
    """
    for fault in faults_at(faults, HostFault):
        estimator = fault.estimator(estimator)
    kind = EstimatorBankSystem if several else EstimatorSystem
    host = kind(estimator, offset=vision_slot(ESTIMATOR_SLOT, time_step))
    host.set_name("host")
    return host


def link_of(scenario: Any, faults: Sequence[Fault] = (), message: Any = Prediction) -> LinkSystem:
    """Returns the link of a scenario as a System named "link".

    Args:
        scenario: a scenario of any task.
        faults: the injected faults, of which only faults of the link are used.
        message: type of the packets.

    Raises DrakeTrackerError for settings out of range.
    """

    def with_faults(link: Link[Any]) -> Link[Any]:
        for fault in faults_at(faults, LinkFault):
            link = fault.link(link, message)
        return link

    return make_link(scenario.link, seed=scenario.seed, time_step=scenario.time_step, wrap=with_faults, message=message)


def check_custom_parts(scenario: Any) -> None:
    """Makes the custom parts of a scenario once, to find errors in them before a long job starts.

    Raises DrakeTrackerError when one of them cannot be used.
    """
    if isinstance(scenario.estimator, Custom):
        estimator_of(scenario.estimator, scenario.where("estimator"))
    if isinstance(scenario.arm, Custom):
        arm_of(scenario)
