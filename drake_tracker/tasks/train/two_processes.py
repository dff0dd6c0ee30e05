"""The subsystems of the train in two processes that are connected by LCM."""

from collections.abc import Callable

from pydrake.lcm import DrakeLcm

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.network.arm_side_diagram import ArmSideDiagram, ImageSenderDiagram, RemoteHostDiagram
from drake_tracker.network.channels import (
    CAMERAS,
    FROM_HOST,
    FROM_TRACKER,
    FROM_VISION,
    POINT,
    TRACKS,
    new_identifier,
    vectors,
)
from drake_tracker.network.host_side_diagram import HostSideDiagram
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.registry import require_task
from drake_tracker.tasks.train.diagram import build, make_train_host
from drake_tracker.tasks.train.setup import TrainSetup, resolve
from drake_tracker.tasks.train.vision import image_vision

_WHY = "only the train runs in two processes; for the ball, camera and arm find the board together"


def make_arm_side(scenario: BaseScenario, lcm: DrakeLcm, tell: Callable[[str], object] = print) -> ArmSideDiagram:
    """Returns the diagram of the arm's process: laboratory, link and arm, which exchange messages with the host.

    The link is in this process, so that its losses also apply to packets of a custom host.

    Args:
        scenario: the scenario.
        lcm: connection to the host.
        tell: called with each line of news for the user.

    Raises DrakeTrackerError when the scenario cannot be built, or when its task is not the train.
    """
    setup = resolve_split(scenario)
    known = vectors(scenario.time_step, len(setup.arm.q_start))
    run = new_identifier()
    if setup.measured:
        host = RemoteHostDiagram(lcm, TRACKS if setup.several else POINT, FROM_HOST, known, run, tell)
        return ArmSideDiagram(build(setup, host=host), lcm, known, run)
    image_vision(setup)  # raises what would be wrong with the vision in the other process
    heard = FROM_HOST + FROM_VISION + (FROM_TRACKER if setup.several else ())
    host = RemoteHostDiagram(lcm, (), heard, known, run, tell)
    return ArmSideDiagram(build(setup, vision=ImageSenderDiagram(lcm, CAMERAS, run), host=host), lcm, known, run)


def make_host_side(
    scenario: BaseScenario, incoming: DrakeLcm, outgoing: DrakeLcm
) -> tuple[HostSideDiagram, dict[str, tuple[int, int]]]:
    """Returns the diagram of the host's process: vision and estimator.

    Args:
        scenario: the scenario.
        incoming: connection on which sensor messages arrive.
        outgoing: connection on which packets are sent.

    Returns (diagram, {port: (width, height) [px]} of the images that it reads).

    Raises DrakeTrackerError when the scenario cannot be built, or when its task is not the train.
    """
    setup = resolve_split(scenario)
    # The cameras are synchronous, but their stamps are rounded to microseconds: half a cycle of tolerance.
    tolerance = 0.5 * VISION_PERIOD
    vision = None if setup.measured else image_vision(setup, own_stamps=True, stamp_tolerance=tolerance)
    # The host need not know the arm unless its vision masks it.
    known = vectors(scenario.time_step, *([len(setup.arm.q_start)] if setup.arm_signals else []))
    side = HostSideDiagram(vision, make_train_host(setup), incoming, outgoing, known)
    return side, {} if setup.measured else setup.image_sizes


def code_of_host(scenario: BaseScenario) -> list[str]:
    """Returns the settings whose custom code the host's process runs.

    Raises DrakeTrackerError when the task of a scenario is not the train.
    """
    require_task(scenario, "train", _WHY)
    return ["estimator", "arm"] if resolve(scenario).arm_signals else ["estimator"]


def resolve_split(scenario: BaseScenario) -> TrainSetup:
    """Returns the resolved scenario. Raises DrakeTrackerError when it cannot be split into two processes."""
    require_task(scenario, "train", _WHY)
    setup = resolve(scenario)
    if setup.sees_hand:
        raise DrakeTrackerError(
            f"{scenario.where('arm.markers')}: markers on the hand need one process; the network carries no hand points"
        )
    if setup.has_wrist:
        raise DrakeTrackerError(
            f"{scenario.where('cameras.wrist')} must be !NoWristCamera: its images are not sent between processes"
        )
    return setup
