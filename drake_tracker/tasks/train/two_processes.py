"""The subsystems of the train in two processes that are connected by LCM."""

from pydrake.lcm import DrakeLcm

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.diagrams.hand_eye import BETWEEN_SUBSYSTEMS, WITH_MEASURED_TRACKS
from drake_tracker.network.arm_side_diagram import ArmSideDiagram
from drake_tracker.network.channels import CAMERAS, FROM_HOST, FROM_TRACKER, FROM_VISION, POINT, TRACKS, vectors
from drake_tracker.network.host_side_diagram import HostSideDiagram
from drake_tracker.network.remote_host_diagram import ImageSenderDiagram, RemoteHostDiagram
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.registry import require_task
from drake_tracker.tasks.train.diagram import assemble, train_host
from drake_tracker.tasks.train.scenario import Measured, TrainScenario
from drake_tracker.tasks.train.vision_parts import (
    RenderedWindow,
    arm_signals,
    measured_vision,
    rendered_vision,
    sees_hand,
    tracks_several,
)
from drake_tracker.tasks.train.wrist_parts import has_wrist
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram
from drake_tracker.vision.several_vision_diagram import SeveralVisionDiagram


def make_arm_side(scenario: TrainScenario, lcm: DrakeLcm) -> ArmSideDiagram:
    """Returns the diagram of the arm's process: laboratory, link and arm, which exchange messages with the host.

    The link is in this process, so that its losses also apply to packets of a custom host.

    Args:
        scenario: the scenario.
        lcm: connection to the host.

    Raises DrakeTrackerError when the scenario cannot be built, or when its task is not the train.
    """
    check_task(scenario)
    known = vectors(scenario.time_step, len(arm_of(scenario).q_start))
    several = tracks_several(scenario)
    if isinstance(scenario.vision, Measured):
        host = RemoteHostDiagram(lcm, TRACKS if several else POINT, FROM_HOST, known)
        arrows = WITH_MEASURED_TRACKS if several else BETWEEN_SUBSYSTEMS
        return ArmSideDiagram(assemble(scenario, measured_vision(scenario), {}, host, arrows), lcm, known)
    _, windows = rendered_vision(scenario)
    heard = FROM_HOST + FROM_VISION + (FROM_TRACKER if several else ())
    host = RemoteHostDiagram(lcm, (), heard, known)
    arrows = tuple(arrow for arrow in BETWEEN_SUBSYSTEMS if arrow[0] != "vision")
    return ArmSideDiagram(assemble(scenario, ImageSenderDiagram(lcm, CAMERAS), windows, host, arrows), lcm, known)


def make_host_side(
    scenario: TrainScenario, incoming: DrakeLcm, outgoing: DrakeLcm
) -> tuple[HostSideDiagram, dict[str, tuple[int, int]]]:
    """Returns the diagram of the host's process: vision and estimator.

    Args:
        scenario: the scenario.
        incoming: connection on which sensor messages arrive.
        outgoing: connection on which packets are sent.

    Returns (diagram, {port: (width, height) [px]} of the images that it reads).

    Raises DrakeTrackerError when the scenario cannot be built, or when its task is not the train.
    """
    check_task(scenario)
    vision: VisionDiagram | SeveralVisionDiagram | None = None
    windows: dict[str, RenderedWindow] = {}
    if not isinstance(scenario.vision, Measured):
        # The cameras are synchronous, but their stamps are rounded to microseconds: half a cycle of tolerance.
        vision, windows = rendered_vision(scenario, own_stamps=True, stamp_tolerance=0.5 * VISION_PERIOD)
    # The host need not know the arm unless its vision masks it.
    known = vectors(scenario.time_step, *([len(arm_of(scenario).q_start)] if arm_signals(scenario) else []))
    side = HostSideDiagram(vision, train_host(scenario), incoming, outgoing, known)
    return side, {port: window[2:] for port, window in windows.items()}


def check_task(scenario: BaseScenario) -> None:
    """Raises DrakeTrackerError when a scenario cannot be split into two processes."""
    why = "only the train runs in two processes; for the ball, camera and arm find the board together"
    require_task(scenario, "train", why)
    if isinstance(scenario, TrainScenario) and sees_hand(scenario):
        raise DrakeTrackerError(
            f"{scenario.where('arm.markers')}: markers on the hand need one process; the network carries no hand points"
        )
    if isinstance(scenario, TrainScenario) and has_wrist(scenario):
        raise DrakeTrackerError(
            f"{scenario.where('cameras.wrist')} must be !NoWristCamera: its images are not sent between processes"
        )
