"""The train's rooms as two processes with the network between them."""

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.diagrams.hand_eye import BETWEEN_SUBSYSTEMS
from drake_tracker.network.arm_side_diagram import ArmSideDiagram
from drake_tracker.network.channels import CAMERAS, FROM_HOST, FROM_VISION, POINT, vectors
from drake_tracker.network.host_side_diagram import HostSideDiagram
from drake_tracker.network.remote_host_diagram import ImageSenderDiagram, RemoteHostDiagram
from drake_tracker.tasks.train.diagram import assemble, train_host
from drake_tracker.tasks.train.scenario import Measured
from drake_tracker.tasks.train.vision_parts import measured_vision, rendered_vision


def make_arm_side(scenario, lcm):
    """Returns the `ArmSideDiagram` of a scenario: laboratory, link and arm, with the host behind a DrakeLcm.

    The link stands in this process, behind the network, so that what it loses is lost whoever sends. Raises
    DrakeTrackerError as `make_diagram`, and where the task is not the train's.
    """
    check_task(scenario)
    known = vectors(scenario.time_step, len(arm_of(scenario).q_start))
    if isinstance(scenario.vision, Measured):
        host = RemoteHostDiagram(lcm, POINT, FROM_HOST, known)
        return ArmSideDiagram(assemble(scenario, measured_vision(scenario), {}, host), lcm, known)
    _, windows = rendered_vision(scenario)
    host = RemoteHostDiagram(lcm, (), FROM_HOST + FROM_VISION, known)
    arrows = tuple(arrow for arrow in BETWEEN_SUBSYSTEMS if arrow[0] != "vision")
    return ArmSideDiagram(assemble(scenario, ImageSenderDiagram(lcm, CAMERAS), windows, host, arrows), lcm, known)


def make_host_side(scenario, incoming, outgoing):
    """Returns (HostSideDiagram, {port: (width, height) [px]}) of a scenario; the second says what images it can read.

    ``incoming`` and ``outgoing`` are each a DrakeLcm. Raises DrakeTrackerError as `make_arm_side`.
    """
    check_task(scenario)
    vision, windows = None, {}
    if not isinstance(scenario.vision, Measured):
        # Half a cycle: the cameras are in step, but their stamps come as whole microseconds, a real one's as it likes.
        vision, windows = rendered_vision(scenario, own_stamps=True, stamp_tolerance=0.5 * VISION_PERIOD)
    side = HostSideDiagram(vision, train_host(scenario), incoming, outgoing, vectors(scenario.time_step))
    return side, {port: window[2:] for port, window in windows.items()}


def check_task(scenario):
    """Raises DrakeTrackerError where the task is not the train's."""
    if scenario.task != "train":
        raise DrakeTrackerError(
            f"{scenario.name}: host and arm know the train alone; before a ball rolls, camera and arm find the board "
            "together, in one process (drake-tracker run)"
        )
