"""The PIPE and the world model of the NIST paper's perception: one motion centroid and its place on the board."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.timing import (
    BALL_THROUGHPUT_CYCLES,
    BALL_UPDATE_CYCLES,
    PROJECTOR_SLOT,
    TIME_STEP,
    VISION_PERIOD,
    lag_of_throughput,
    vision_slot,
)
from drake_tracker.vision.centroid.motion_centroid_system import add_motion_centroid
from drake_tracker.vision.centroid.motion_detector import MotionDetector
from drake_tracker.vision.centroid.plane_projection import PointFilter
from drake_tracker.vision.centroid.plane_projector_system import PlaneProjectorSystem
from drake_tracker.vision.centroid.search_window import SearchWindow


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

    ``camera`` is an `ImageRgba8U` of the full frame or a part of it, read every `VISION_PERIOD` at offset 0.
    ``centroid`` is a `Centroid` vector [px] at the end of the pipeline, new every ``update_cycles``; ``point`` is a
    `TrackPoint` vector in W [m], updated every `VISION_PERIOD` in the projector's slot. Both are zeros until the first
    centroid has passed the delay line.
    ``motion`` is the `DetectionMask` and ``motion_images`` all intermediate images of the newest centroid.

    Args:
        detector: `MotionDetector`, with its window.
        camera: in the board's frame (`plane_projection.camera_on_board`).
        X_WB: (4, 4), takes p_BQ to p_WQ [m].
        height: of the centroid above the plane, along its normal [m].
        plausible: `PointFilter` that rejects outliers.
        image_offset: full-frame coordinates (u0, v0) [px] of the image's top left pixel.
        update_cycles: cycles from one centroid to the next.
        throughput_cycles: cycles from the capture of a centroid's first image until the centroid is output.
        follow: `SearchWindow`, or None for the detector's own window alone.
        time_step: of the plant [s], which the slots divide.
        image_latency: cycles from the capture of an image until the input shows it, as with a `PipelinedCamera`. It
            does not change ``centroid`` and ``point``; ``motion`` is as late as the images.

    Attributes:
        lag: time from a centroid's stamp until it is output [s].

    Raises DrakeTrackerError when the throughput is too short for the detector's images.
    """

    def __init__(
        self,
        detector: MotionDetector,
        camera: CameraModel,
        X_WB: ArrayLike,
        height: float,
        plausible: PointFilter,
        *,
        image_offset: tuple[int, int] = (0, 0),
        update_cycles: int = BALL_UPDATE_CYCLES,
        throughput_cycles: int = BALL_THROUGHPUT_CYCLES,
        follow: SearchWindow | None = None,
        time_step: float = TIME_STEP,
        image_latency: int = 0,
    ) -> None:
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        lag = lag_of_throughput(throughput_cycles, detector.buffer_length - 1, detector.stamp_age_cycles)
        centroid = add_motion_centroid(
            builder,
            detector=detector,
            image_offset=image_offset,
            lag_cycles=lag,
            update_cycles=update_cycles,
            follow=follow,
            image_latency=image_latency,
            name="motion",
        )
        offset = vision_slot(PROJECTOR_SLOT, time_step)
        projector = builder.AddNamedSystem(
            "projector",
            PlaneProjectorSystem(camera, np.asarray(X_WB), height, plausible, offset=offset),
        )
        builder.ExportInput(centroid.image_input_port, "camera")
        builder.Connect(centroid.output_port, projector.GetInputPort("centroid"))
        builder.ExportOutput(projector.GetOutputPort("point"), "point")
        builder.ExportOutput(centroid.output_port, "centroid")
        builder.ExportOutput(centroid.system.GetOutputPort("motion_energy"), "motion")
        builder.ExportOutput(centroid.system.GetOutputPort("motion_images"), "motion_images")
        builder.BuildInto(self)
        self.lag = lag * VISION_PERIOD
