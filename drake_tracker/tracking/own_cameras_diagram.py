"""Vision and estimation behind cameras of one's own: no world, no arm."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.core.timing import ESTIMATOR_SLOT, vision_slot
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.footage.timeline import MOST_STAMP_DIFFERENCE
from drake_tracker.footage.video_source_system import VideoSource
from drake_tracker.vision.board_vision_diagram import BoardVisionDiagram
from drake_tracker.vision.motion_centroid_system import add_motion_centroid
from drake_tracker.vision.plane_projection import EveryReading, camera_on_board
from drake_tracker.vision.vision_diagram import VisionDiagram

MAX_GAP = 0.03
"""Two rays that pass each other by more [m] are not of one point."""
EXTRA_CYCLES = 1
"""Cycles that a centroid spends in the delay line, its shortest: nothing here imitates the lag of 1991."""


@dataclass(frozen=True, eq=False)
class Plane:
    """Where something moves: X_WP (4, 4) of a plane whose z is its normal, and the height [m] above it."""

    X_WP: np.ndarray
    height: float = 0.0


class OwnCamerasDiagram(Diagram):
    """From footage to points and a predicted path.

    .. pydrake_system::

        name: OwnCamerasDiagram
        output_ports:
        - camera_left
        - frame_left
        - centroid_left
        - motion_left
        - camera_right
        - frame_right
        - centroid_right
        - motion_right
        - point
        - filtered
        - prediction

    A single camera is the left one. ``camera_*`` and ``frame_*`` are those of `VideoSource`, the others those of
    `VisionDiagram` and `EstimatorSystem`. ``point``, ``filtered`` and ``prediction`` are there when the cameras are
    calibrated: two of them, or one and a plane.

    Args:
        timeline: `Timeline` of one or two cameras.
        detectors: a motion detector for each.
        cameras: a `CameraModel` for each, or empty.
        estimator: one of `drake_tracker.estimation`, or None.
        plane: `Plane` on which a single camera sees things move, or None.
        max_gap: of the `TriangulatorSystem` [m].
    """

    def __init__(self, timeline, detectors, cameras=(), estimator=None, *, plane=None, max_gap=MAX_GAP):
        super().__init__()
        self.set_name("own_cameras")
        self.sides = ("left", "right")[: len(timeline.sequences)]
        period = timeline.period
        builder = DiagramBuilder()
        if len(self.sides) == 2:
            vision = self._add_stereo(builder, cameras, detectors, period, max_gap)
        elif cameras:
            vision = self._add_on_plane(builder, cameras[0], detectors[0], period, plane)
        else:
            vision = self._add_centroid(builder, detectors[0], period)
        for side, sequence in zip(self.sides, timeline.sequences):
            source = builder.AddNamedSystem(f"source_{side}", VideoSource(sequence, period))
            for name, port in (("camera", "image"), ("frame", "frame")):
                builder.Connect(source.GetOutputPort(port), vision[f"{name}_{side}"])
                builder.ExportOutput(source.GetOutputPort(port), f"{name}_{side}")
            for name in ("centroid", "motion"):
                builder.ExportOutput(vision[f"{name}_{side}"], f"{name}_{side}")
        self.has_points = "point" in vision
        if self.has_points:
            offset = vision_slot(ESTIMATOR_SLOT, period)
            host = builder.AddNamedSystem("host", EstimatorSystem(estimator, period=period, offset=offset))
            builder.Connect(vision["point"], host.GetInputPort("point"))
            builder.ExportOutput(vision["point"], "point")
            for name in ("filtered", "prediction"):
                builder.ExportOutput(host.GetOutputPort(name), name)
        builder.BuildInto(self)

    @staticmethod
    def _add_stereo(builder, cameras, detectors, period, max_gap):
        cameras, detectors = (dict(zip(("left", "right"), pair)) for pair in (cameras, detectors))
        vision = builder.AddSystem(
            VisionDiagram(
                cameras,
                None,
                {side: (0, 0, camera.width, camera.height) for side, camera in cameras.items()},
                None,
                detectors["left"].stamp_age_cycles + EXTRA_CYCLES,
                None,
                detectors=detectors,
                period=period,
                own_stamps=True,
                max_gap=max_gap,
                stamp_tolerance=MOST_STAMP_DIFFERENCE * period,
            )
        )
        outputs = ["point"] + [f"{name}_{side}" for name in ("centroid", "motion") for side in cameras]
        ports = {name: vision.GetOutputPort(name) for name in outputs}
        return ports | {
            f"{name}_{side}": vision.GetInputPort(f"{name}_{side}") for name in ("camera", "frame") for side in cameras
        }

    @staticmethod
    def _add_on_plane(builder, camera, detector, period, plane):
        X_CP = camera.X_CW @ plane.X_WP
        vision = builder.AddSystem(
            BoardVisionDiagram(
                detector,
                camera_on_board(camera.K, X_CP, camera.width, camera.height, camera.distortion),
                plane.X_WP,
                plane.height,
                EveryReading(),
                update_cycles=1,
                throughput_cycles=detector.buffer_length - 1 + EXTRA_CYCLES,
                own_stamps=True,
                period=period,
                time_step=period,
            )
        )
        return {
            "camera_left": vision.GetInputPort("camera"),
            "frame_left": vision.GetInputPort("frame"),
            "point": vision.GetOutputPort("point"),
            "centroid_left": vision.GetOutputPort("centroid"),
            "motion_left": vision.GetOutputPort("motion"),
        }

    @staticmethod
    def _add_centroid(builder, detector, period):
        lag = detector.stamp_age_cycles + EXTRA_CYCLES
        motion = add_motion_centroid(builder, "motion", detector, lag_cycles=lag, period=period, own_stamps=True)
        return {
            "camera_left": motion.image_input_port,
            "frame_left": motion.frame_input_port,
            "centroid_left": motion.output_port,
            "motion_left": motion.system.GetOutputPort("motion_energy"),
        }
