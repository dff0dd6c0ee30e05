"""A vision that also sees the robot's own hand, as a Diagram."""

from collections.abc import Mapping

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.marker_kinematics import MarkerKinematics
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.messages import JawState, message_size
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD, lag_after_latency
from drake_tracker.vision.delay_line_system import DelayLineSystem
from drake_tracker.vision.hand.hand_markers import MarkerSearch
from drake_tracker.vision.hand.hand_markers_system import HandMarkersSystem
from drake_tracker.vision.several_vision_diagram import HAND_DISPLACEMENTS


class HandVisionDiagram(Diagram):
    """Adds the markers of the hand to the vision of an object.

    .. pydrake_system::

        name: HandVisionDiagram
        input_ports:
        - camera_left
        - camera_right
        - arm_state
        - jaws
        output_ports:
        - hand_point

    All ports of ``vision`` are ports of this Diagram, except ``displacement_*``: if the vision masks the arm, the
    measured markers displace the mask. Other ports and the arguments are those of the `HandMarkersSystem`, except that
    ``arm_state`` and ``jaws`` are the present ones, and that ``hand_point`` is ``lag_cycles`` later than its images.

    Args:
        vision: a `VisionDiagram` or a `SeveralVisionDiagram`.
        kinematics: as for `HandMarkersSystem`.
        cameras: as for `HandMarkersSystem`.
        windows: as for `HandMarkersSystem`.
        height: as for `HandMarkersSystem`.
        num_joints: as for `HandMarkersSystem`.
        search: as for `HandMarkersSystem`.
        keep: as for `HandMarkersSystem`.
        lag_cycles: cycles from the capture of an image until the hand that it shows appears.
        period: as for `HandMarkersSystem`.
        image_latency: as for `HandMarkersSystem`.
        update_cycles: as for `HandMarkersSystem`.

    Raises DrakeTrackerError when the lag is shorter than the latency.
    """

    def __init__(
        self,
        vision: Diagram,
        kinematics: MarkerKinematics,
        cameras: Mapping[str, CameraModel],
        windows: Mapping[str, tuple[int, int, int, int]],
        height: float,
        num_joints: int,
        search: MarkerSearch = MarkerSearch(),
        *,
        keep: float = 3.0,
        lag_cycles: int = LAG_CYCLES,
        period: float = VISION_PERIOD,
        image_latency: int = 0,
        update_cycles: int = 1,
    ) -> None:
        super().__init__()
        self.set_name("vision")
        delay = lag_after_latency(lag_cycles, image_latency)
        builder = DiagramBuilder()
        vision.set_name("object_vision")
        builder.AddSystem(vision)
        for index in range(vision.num_output_ports()):
            output = vision.get_output_port(index)
            builder.ExportOutput(output, output.get_name())
        hand = builder.AddNamedSystem(
            "hand_markers",
            HandMarkersSystem(
                kinematics,
                cameras,
                windows,
                height,
                num_joints,
                search,
                keep=keep,
                delay_cycles=delay,
                period=period,
                image_latency=image_latency,
                update_cycles=update_cycles,
            ),
        )
        for index in range(vision.num_input_ports()):
            port = vision.get_input_port(index)
            if port.get_name() in HAND_DISPLACEMENTS:
                builder.Connect(hand.GetOutputPort(port.get_name()), port)
            else:
                builder.ExportInput(port, port.get_name())
        for side in SIDES:
            builder.ConnectInput(f"camera_{side}", hand.GetInputPort(f"camera_{side}"))
        for name, size in (("arm_state", 2 * num_joints), ("jaws", message_size(JawState))):
            port = hand.GetInputPort(name)
            if image_latency > 0:
                # Vision reads the line before it takes in the newest sample, hence one step less.
                delay_line = DelayLineSystem(size, image_latency - 1, period=period)
                line = builder.AddNamedSystem(f"{name}_of_hand", delay_line)
                builder.Connect(line.get_output_port(), port)
                port = line.get_input_port()
            if vision.HasInputPort(name):
                builder.ConnectInput(name, port)
            else:
                builder.ExportInput(port, name)
        builder.ExportOutput(hand.GetOutputPort("hand_point"), "hand_point")
        builder.BuildInto(self)
