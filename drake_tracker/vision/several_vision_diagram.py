"""The vision that tracks several objects, as a Diagram."""

from collections.abc import Mapping

from numpy.typing import ArrayLike
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort

from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.timing import (
    LAG_CYCLES,
    PROJECTOR_SLOT,
    TIME_STEP,
    VISION_PERIOD,
    lag_after_latency,
    vision_slot,
)
from drake_tracker.vision.hand.arm_silhouette_system import add_arm_silhouette
from drake_tracker.vision.hand.wrist_view_diagram import WristParts, add_wrist_view
from drake_tracker.vision.region_of_interest import RegionOfInterest
from drake_tracker.vision.silhouettes.background_model import BackgroundModel
from drake_tracker.vision.silhouettes.background_subtraction_system import BackgroundSubtractionSystem
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.tracker import Tracker
from drake_tracker.vision.silhouettes.tracker_system import TrackerSystem
from drake_tracker.vision.triangulator_system import MAX_GAP, STAMP_TOLERANCE

HAND_DISPLACEMENTS = tuple(f"displacement_{side}" for side in SIDES)
"""Inputs that markers on the hand drive. Left unconnected, the arm is masked where its joints say that it is."""


class SeveralVisionDiagram(Diagram):
    """From two images to the tracks of all objects, and the point of the target.

    .. pydrake_system::

        name: SeveralVisionDiagram
        input_ports:
        - camera_left
        - camera_right
        - expected
        - arm_state
        - jaws
        - selected
        - displacement_left
        - displacement_right
        output_ports:
        - point
        - tracks
        - regions_left
        - regions_right
        - centroid_left
        - centroid_right
        - motion_left
        - motion_right

    ``camera_*`` are `ImageRgba8U`, read every ``period`` at offset 0. ``expected`` is a `TrackPredictions` vector of
    the host. ``selected`` is the number of the track that the operator selected, and may stay unconnected. The outputs
    are those of the `TrackerSystem`, ``lag_cycles`` after the capture of the images, and ``motion_*``, the silhouettes
    of the newest images as `DetectionMask`.

    With ``arm`` only, there are ``arm_state``, ``jaws`` and ``displacement_*``: the joints (q, v) [rad, rad/s] and a
    `JawState` at the same instants, and by how much the hand is displaced in the images (`ArmSilhouetteSystem`), which
    may stay unconnected. With ``wrist`` there are the inputs ``camera_wrist`` and ``prediction`` and the output
    ``wrist``, and the outputs ``point`` and ``tracks`` are those of the `WristViewSystem`, which also needs
    ``arm_state`` and ``jaws``. With ``own_stamps`` there are the inputs ``frame_left`` and ``frame_right`` too, a
    `FrameInfo` vector each.

    Args:
        cameras: {"left": `CameraModel`, "right": `CameraModel`}, calibrated.
        settings: `SilhouetteTracker`, whose ``target`` may also be a `TargetRule`.
        windows: the same keys, `RegionOfInterest` in which objects are searched for; None is the whole image.
        image_windows: the same keys, rectangle (u0, v0, width, height) [px] of the full frame that the images cover;
            None is the full frame.
        arm: shape and number of joints of the arm whose silhouette is masked; None masks nothing.
        lag_cycles: cycles from the capture of an image until the tracks that it leads to appear.
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts objects anywhere.
        period: of a cycle [s].
        time_step: the plant's step [s], of which the slot of the tracker is a fraction.
        own_stamps: whether the images have stamps of their own.
        max_gap: largest distance between the two rays of one object [m].
        stamp_tolerance: largest difference of the stamps of the two images [s].
        image_latency: cycles from the capture of an image until the inputs show it, as with a `PipelinedCamera`.
        wrist: the camera on the hand; None without one.

    Raises DrakeTrackerError when the lag is shorter than the latency, or a setting is out of range.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraModel],
        settings: SilhouetteTracker = SilhouetteTracker(),
        *,
        windows: Mapping[str, RegionOfInterest] | None = None,
        image_windows: Mapping[str, tuple[int, int, int, int]] | None = None,
        arm: tuple[ArmShape, int] | None = None,
        lag_cycles: int = LAG_CYCLES,
        work_volume: ArrayLike | None = None,
        period: float = VISION_PERIOD,
        time_step: float = TIME_STEP,
        own_stamps: bool = False,
        max_gap: float = MAX_GAP,
        stamp_tolerance: float = STAMP_TOLERANCE,
        image_latency: int = 0,
        wrist: WristParts | None = None,
    ) -> None:
        super().__init__()
        self.set_name("vision")
        delay = lag_after_latency(lag_cycles, image_latency)
        if image_windows is None:
            image_windows = {side: (0, 0, cameras[side].width, cameras[side].height) for side in SIDES}
        builder = DiagramBuilder()
        tracker = Tracker([cameras[side] for side in SIDES], settings, work_volume=work_volume, max_gap=max_gap)
        offset = vision_slot(PROJECTOR_SLOT, time_step)
        tracking = builder.AddNamedSystem(
            "tracker",
            TrackerSystem(tracker, settings.target, period=period, offset=offset, stamp_tolerance=stamp_tolerance),
        )
        hidden: dict[str, OutputPort] = {}
        if arm is not None:
            system = add_arm_silhouette(builder, cameras, image_windows, arm, period=period, latency=image_latency)
            for side in SIDES:
                hidden[side] = system.GetOutputPort(f"hidden_{side}")
                builder.ExportInput(system.GetInputPort(f"displacement_{side}"), f"displacement_{side}")
        for side in SIDES:
            window = None if windows is None else windows[side].mask(image_windows[side])
            system = builder.AddNamedSystem(
                f"foreground_{side}",
                BackgroundSubtractionSystem(
                    BackgroundModel(settings.silhouettes, window=window, update_cycles=settings.update_cycles),
                    image_offset=image_windows[side][:2],
                    delay_cycles=delay,
                    period=period,
                    image_latency=image_latency,
                    own_stamps=own_stamps,
                    camera_motion=settings.camera_motion,
                    update_cycles=settings.update_cycles,
                ),
            )
            builder.ExportInput(system.GetInputPort("color_image"), f"camera_{side}")
            if own_stamps:
                builder.ExportInput(system.GetInputPort("frame"), f"frame_{side}")
            if side in hidden:
                builder.Connect(hidden[side], system.GetInputPort("hidden"))
                builder.ConnectInput(f"displacement_{side}", system.GetInputPort("displacement"))
            builder.Connect(system.GetOutputPort("delayed"), tracking.GetInputPort(f"foreground_{side}"))
            builder.ExportOutput(system.GetOutputPort("motion_energy"), f"motion_{side}")
        for name in ("expected", "selected"):
            builder.ExportInput(tracking.GetInputPort(name), name)
        taken: dict[str, OutputPort] = {}
        if wrist is not None:
            taken = add_wrist_view(
                builder,
                tracking,
                wrist,
                lag_cycles=int(lag_cycles),
                period=period,
                image_latency=image_latency,
                update_cycles=settings.update_cycles,
                time_step=time_step,
                shares_arm=arm is not None,
            )
        ports = [tracking.get_output_port(index) for index in range(tracking.num_output_ports())]
        for name, port in ({port.get_name(): port for port in ports} | taken).items():
            builder.ExportOutput(port, name)
        builder.BuildInto(self)
