"""The PIPE: two motion centroids with the paper's lag, and their triangulation, as a Diagram."""

from collections.abc import Callable, Mapping

from numpy.typing import ArrayLike
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD
from drake_tracker.vision.centroid.motion_centroid_system import MotionCentroidSystem, add_motion_centroid
from drake_tracker.vision.centroid.motion_detector import MotionDetector
from drake_tracker.vision.triangulator_system import MAX_GAP, STAMP_TOLERANCE, add_triangulator


class VisionDiagram(Diagram):
    """From two images to a point in the world.

    .. pydrake_system::

        name: VisionDiagram
        input_ports:
        - camera_left
        - camera_right
        output_ports:
        - point
        - centroid_left
        - centroid_right
        - motion_left
        - motion_right
        - motion_images_left
        - motion_images_right

    ``camera_*`` are `ImageRgba8U`, read every ``period`` at offset 0. ``centroid_*`` are `Centroid` vectors [px] at the
    end of the pipeline, ``lag_cycles`` after their stamp; ``point`` is a `TrackPoint` vector in W [m] that follows them
    at once. All are zeros until the first centroid has passed the delay line. ``motion_*`` is the `DetectionMask` and
    ``motion_images_*`` all intermediate images of the newest cycle, for pictures. With ``own_stamps`` there are the
    inputs ``frame_left`` and ``frame_right`` too, a `FrameInfo` vector each. ``image_latency`` does not change
    ``centroid_*`` and ``point``; ``motion_*`` are as late as the images.

    Args:
        cameras: {"left": `CameraModel`, "right": `CameraModel`}, calibrated.
        detectors: the same keys, a `MotionDetector` each, with its window.
        image_windows: the same keys, rectangle (u0, v0, width, height) [px] of the full frame that the images cover;
            None is the full frame.
        lag_cycles: cycles from the stamp of a centroid, which is the capture of its middle image, until it appears.
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts points anywhere.
        period: of a cycle [s].
        system_classes: the same keys, what makes the `MotionCentroidSystem` of each camera, for derived Systems. Their
            further outputs are outputs of the Diagram, with the name of the camera.
        own_stamps: whether the images have stamps of their own.
        grey: whether they are `ImageGrey8U`, with grey values only.
        max_gap: of the `TriangulatorSystem` [m].
        stamp_tolerance: of the `TriangulatorSystem` [s].
        image_latency: cycles from the capture of an image until the inputs show it, as with a `PipelinedCamera`.
        reduce_by: of each `MotionCentroidSystem`.

    Raises DrakeTrackerError when the lag is too short for a detector's images, or the work volume is not a box.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraModel],
        detectors: Mapping[str, MotionDetector],
        *,
        image_windows: Mapping[str, tuple[int, int, int, int]] | None = None,
        lag_cycles: float = LAG_CYCLES,
        work_volume: ArrayLike | None = None,
        period: float = VISION_PERIOD,
        system_classes: Mapping[str, Callable[..., MotionCentroidSystem]] | None = None,
        own_stamps: bool = False,
        grey: bool = False,
        max_gap: float = MAX_GAP,
        stamp_tolerance: float = STAMP_TOLERANCE,
        image_latency: int = 0,
        reduce_by: int = 1,
    ) -> None:
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        triangulator = add_triangulator(
            builder,
            cameras=[cameras[side] for side in SIDES],
            work_volume=work_volume,
            max_gap=max_gap,
            stamp_tolerance=stamp_tolerance,
        )
        builder.ExportOutput(triangulator.point_port, "point")
        for side, centroid_port in zip(SIDES, triangulator.centroid_ports):
            centroid = add_motion_centroid(
                builder,
                detector=detectors[side],
                image_offset=(0, 0) if image_windows is None else image_windows[side][:2],
                lag_cycles=lag_cycles,
                system_class=MotionCentroidSystem if system_classes is None else system_classes[side],
                period=period,
                own_stamps=own_stamps,
                grey=grey,
                image_latency=image_latency,
                reduce_by=reduce_by,
                name=f"motion_{side}",
            )
            builder.ExportInput(centroid.image_input_port, f"camera_{side}")
            if own_stamps:
                builder.ExportInput(centroid.frame_input_port, f"frame_{side}")
            builder.Connect(centroid.output_port, centroid_port)
            builder.ExportOutput(centroid.output_port, f"centroid_{side}")
            builder.ExportOutput(centroid.system.GetOutputPort("motion_energy"), f"motion_{side}")
            for index in range(2, centroid.system.num_output_ports()):
                port = centroid.system.get_output_port(index)
                builder.ExportOutput(port, f"{port.get_name()}_{side}")
        builder.BuildInto(self)
