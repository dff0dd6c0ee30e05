"""The vision of the conveyor on images, as a Diagram."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.belt_frame import BeltFrame
from drake_tracker.core.constants import SIDES
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD, lag_after_latency
from drake_tracker.vision.delay_line_system import DelayLineSystem
from drake_tracker.vision.hand.arm_silhouette_system import add_arm_silhouette
from drake_tracker.vision.parts.belt_surface import BeltSurface
from drake_tracker.vision.parts.config import BeltParts
from drake_tracker.vision.parts.part_search import PartSearch
from drake_tracker.vision.parts.part_silhouette import PartSilhouette
from drake_tracker.vision.parts.part_tracker import PartTracker
from drake_tracker.vision.parts.part_vision_system import PartVisionSystem
from drake_tracker.vision.region_of_interest import RegionOfInterest, region_around


class PartVisionDiagram(Diagram):
    """From two images to the parts on a belt, some cycles late.

    .. pydrake_system::

        name: PartVisionDiagram
        input_ports:
        - camera_left
        - camera_right
        - arm_state
        - jaws
        output_ports:
        - parts
        - tracks
        - regions_left
        - regions_right
        - centroid_left
        - centroid_right
        - motion_left
        - motion_right

    The ports are the ports of the `PartVisionSystem`. All vectors appear ``lag_cycles`` after the capture of the
    images, ``motion_*`` at once. ``arm_state``, the joints (q, v) [rad, rad/s], and ``jaws``, a `JawState`, exist with
    ``arm`` only, whose silhouette is then ignored in the images.

    Args:
        cameras: {side: calibrated camera}.
        image_windows: {side: part of the full image that the images show (u0, v0, width, height) [px]}.
        belt: lowest and highest corner (x, y) in W of the piece of belt that is looked at, shape (2, 2) [m].
        belt_height: z_W of the belt's upper face [m].
        reach: smallest and largest y of the parts that are reported [m].
        frame: of the belt, in which ``belt``, ``belt_height`` and ``reach`` are given. The parts are found in it, as by
            cameras that are turned with it, and reported in W.
        settings: `BeltParts`.
        arm: shape and number of joints of the arm; None ignores nothing.
        lag_cycles: cycles from the capture of an image until its parts appear.
        update_cycles: cycles from one pair of images that is looked at to the next.
        image_latency: cycles from the capture of an image until the inputs show it.
        period: of a cycle [s].

    Raises DrakeTrackerError when the lag is shorter than the latency, or a setting is out of range.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraModel],
        *,
        image_windows: Mapping[str, tuple[int, int, int, int]],
        belt: np.ndarray,
        belt_height: float,
        reach: tuple[float, float],
        frame: BeltFrame = BeltFrame(),
        settings: BeltParts = BeltParts(),
        arm: tuple[ArmShape, int] | None = None,
        lag_cycles: int = LAG_CYCLES,
        update_cycles: int = 1,
        image_latency: int = 0,
        period: float = VISION_PERIOD,
    ) -> None:
        super().__init__()
        self.set_name("vision")
        delay = lag_after_latency(lag_cycles, image_latency)
        turned = {side: camera_over_belt(camera, frame) for side, camera in cameras.items()}
        belts = {
            side: belt_window(camera, belt, belt_height).mask(image_windows[side]) for side, camera in turned.items()
        }
        windows = [image_windows[side] for side in SIDES]
        tracker = PartTracker(
            [PartSilhouette(turned[side], image_windows[side], belt_height) for side in SIDES],
            PartSearch([turned[side] for side in SIDES], windows, belt_height, belt),
            reach[1],
            settings,
        )
        surfaces = {
            side: BeltSurface(camera, image_windows[side], belts[side], belt_height, settings)
            for side, camera in turned.items()
        }
        builder = DiagramBuilder()
        system = builder.AddNamedSystem(
            "parts",
            PartVisionSystem(
                surfaces,
                tracker,
                image_windows=image_windows,
                belts=belts,
                belt_height=belt_height,
                reach=reach,
                frame=frame,
                period=period,
                update_cycles=update_cycles,
                image_latency=image_latency,
            ),
        )
        for side in SIDES:
            builder.ExportInput(system.GetInputPort(f"camera_{side}"), f"camera_{side}")
        if arm is not None:
            silhouette = add_arm_silhouette(builder, cameras, image_windows, arm, period=period, latency=image_latency)
            for side in SIDES:
                builder.Connect(silhouette.GetOutputPort(f"hidden_{side}"), system.GetInputPort(f"hidden_{side}"))
        for index in range(system.num_output_ports()):
            port = system.get_output_port(index)
            name = port.get_name()
            if name.startswith("motion"):
                builder.ExportOutput(port, name)
                continue
            line = builder.AddNamedSystem(f"{name}_lag", DelayLineSystem(port.size(), delay, period=period))
            builder.Connect(port, line.get_input_port())
            builder.ExportOutput(line.get_output_port(), name)
        builder.BuildInto(self)


def camera_over_belt(camera: CameraModel, frame: BeltFrame) -> CameraModel:
    """Returns a camera as seen from the frame of a belt: it takes points in this frame for points in W."""
    return camera if frame.angle == 0.0 else replace(camera, X_CW=camera.X_CW @ frame.X_WB)


def belt_window(camera: CameraModel, belt: np.ndarray, belt_height: float) -> RegionOfInterest:
    """Returns the window through which a camera sees a piece of belt.

    Args:
        camera: calibrated camera.
        belt: lowest and highest corner (x, y) in W, shape (2, 2) [m].
        belt_height: z_W of its upper face [m].

    Raises DrakeTrackerError when the camera does not see it.
    """
    (x0, y0), (x1, y1) = np.asarray(belt, dtype=float)
    corners = [[x, y, belt_height] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    return region_around(camera, corners)
