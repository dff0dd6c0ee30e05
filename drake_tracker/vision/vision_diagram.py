"""The PIPE: two motion centroids with the paper's lag, and their triangulation, as a Diagram."""

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.motion_centroid_system import add_motion_centroid
from drake_tracker.vision.normal_flow import NormalFlow
from drake_tracker.vision.triangulator_system import STAMP_TOLERANCE, TriangulatorSystem


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

    ``camera_*`` are ImageRgba8U; ``point`` is a `TrackPoint`, ``centroid_*`` are `Centroid` vectors as they come out of
    the pipeline, a lag after their stamp; ``motion_*`` is the `MotionEnergy` and ``motion_images_*`` all
    intermediate images of the newest cycle, for pictures.

    Args:
      cameras: {"left": CameraModel, "right": CameraModel}, calibrated. windows: the same keys, `Window`.
      image_windows: the same keys, (u0, v0, width, height) that the images cover.
      flow: `NormalFlowParameters`. lag_cycles: cycles from capture to centroid. work_volume: box in W [m].
      detectors: the same keys, motion detectors in place of normal flow with ``windows`` and ``flow``.
      period: of a cycle [s]. own_stamps: whether there are inputs ``frame_left`` and ``frame_right``, `FrameInfo`.
      max_gap [m], stamp_tolerance [s]: of the `TriangulatorSystem`.
    """

    def __init__(
        self,
        cameras,
        windows,
        image_windows,
        flow,
        lag_cycles,
        work_volume,
        *,
        detectors=None,
        period=VISION_PERIOD,
        own_stamps=False,
        max_gap=0.03,
        stamp_tolerance=STAMP_TOLERANCE,
    ):
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        triangulator = builder.AddNamedSystem(
            "triangulator",
            TriangulatorSystem(
                cameras["left"],
                cameras["right"],
                work_volume=work_volume,
                max_gap=max_gap,
                stamp_tolerance=stamp_tolerance,
            ),
        )
        builder.ExportOutput(triangulator.GetOutputPort("point"), "point")
        for side in ("left", "right"):
            u0, v0, _, _ = image_windows[side]
            if detectors is None:
                detector = NormalFlow(flow, window=windows[side].mask(image_windows[side]))
            else:
                detector = detectors[side]
            centroid = add_motion_centroid(
                builder,
                f"motion_{side}",
                detector,
                image_offset=(u0, v0),
                lag_cycles=lag_cycles,
                period=period,
                own_stamps=own_stamps,
            )
            builder.ExportInput(centroid.image_input_port, f"camera_{side}")
            if own_stamps:
                builder.ExportInput(centroid.frame_input_port, f"frame_{side}")
            builder.Connect(centroid.output_port, triangulator.GetInputPort(f"centroid_{side}"))
            builder.ExportOutput(centroid.output_port, f"centroid_{side}")
            builder.ExportOutput(centroid.system.GetOutputPort("motion_energy"), f"motion_{side}")
            builder.ExportOutput(centroid.system.GetOutputPort("motion_images"), f"motion_images_{side}")
        builder.BuildInto(self)
