"""The PIPE and the perception's world model of the NIST paper: one motion centroid and its place on the board."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.core.timing import (
    BALL_THROUGHPUT_CYCLES,
    BALL_UPDATE_CYCLES,
    PROJECTOR_SLOT,
    TIME_STEP,
    VISION_PERIOD,
    lag_of_throughput,
    vision_slot,
)
from drake_tracker.vision.motion_centroid_system import add_motion_centroid
from drake_tracker.vision.plane_projector_system import PlaneProjectorSystem


class BoardVisionDiagram(Diagram):
    """From the images of one camera to points on a board, in the world (Nashman and Chaconas 1990, sections 4, 5).

    .. pydrake_system::

        name: BoardVisionDiagram
        input_ports:
        - camera
        output_ports:
        - point
        - centroid
        - motion
        - motion_images

    ``camera`` is an ImageRgba8U of the full frame; ``point`` is a `TrackPoint`, ``centroid`` a `Centroid` as it comes
    out of the pipeline; ``motion`` is the `MotionEnergy` and ``motion_images`` all intermediate images of the newest
    centroid, for pictures.

    Args:
        detector: `FrameDifference` or another detector, with its window.
        camera: a `CameraModel` in the board's frame (`plane_projection.camera_on_board`).
        X_WB: (4, 4), takes p_BQ to p_WQ [m].
        height: of the centroid over the plane, along its normal [m]. plausible: `PlausibleReadings`.
        update_cycles: cycles from one centroid to the next.
        throughput_cycles: cycles from the capture of a centroid's first image until the centroid shows.
        follow: a `PredictedWindow`, or None for the detector's own window alone.
        own_stamps: whether there is an input ``frame``, a `FrameInfo`.
        period: of a cycle [s]. time_step: of the plant [s], which the slots divide.

    Raises DrakeTrackerError when the throughput is too short for the detector's images.
    """

    def __init__(
        self,
        detector,
        camera,
        X_WB,
        height,
        plausible,
        *,
        update_cycles=BALL_UPDATE_CYCLES,
        throughput_cycles=BALL_THROUGHPUT_CYCLES,
        follow=None,
        own_stamps=False,
        period=VISION_PERIOD,
        time_step=TIME_STEP,
    ):
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        lag = lag_of_throughput(throughput_cycles, detector.buffer_length - 1, detector.stamp_age_cycles)
        centroid = add_motion_centroid(
            builder,
            "motion",
            detector,
            lag_cycles=lag,
            period=period,
            update_cycles=update_cycles,
            follow=follow,
            own_stamps=own_stamps,
        )
        projector = builder.AddNamedSystem(
            "projector",
            PlaneProjectorSystem(
                camera,
                np.asarray(X_WB),
                height,
                plausible,
                period=period,
                offset=vision_slot(PROJECTOR_SLOT, time_step),
            ),
        )
        builder.ExportInput(centroid.image_input_port, "camera")
        if own_stamps:
            builder.ExportInput(centroid.frame_input_port, "frame")
        builder.Connect(centroid.output_port, projector.GetInputPort("centroid"))
        builder.ExportOutput(projector.GetOutputPort("point"), "point")
        builder.ExportOutput(centroid.output_port, "centroid")
        builder.ExportOutput(centroid.system.GetOutputPort("motion_energy"), "motion")
        builder.ExportOutput(centroid.system.GetOutputPort("motion_images"), "motion_images")
        builder.BuildInto(self)
        self.lag = lag * period
        """Time [s] from a centroid's stamp until it shows."""
