"""The laboratory of the ball as a Diagram: everything that is real, and the only place that holds the ground truth."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.world.ball.ball_board import face_corners
from drake_tracker.world.ball.ball_camera import NAME, draw_camera_pose
from drake_tracker.world.ball.ball_fixtures import GATE_TRAVEL, KNOCK, SLIDE_AMPLITUDE
from drake_tracker.world.ball.ball_plant import add_ball_laboratory, add_floor
from drake_tracker.world.ball.catch_judge_system import add_catch_judge
from drake_tracker.world.ball.release_system import add_release, draw_delay
from drake_tracker.world.base_world_diagram import BaseWorldDiagram, WorldConfig
from drake_tracker.world.config import BallConfig, BoardCameraConfig, BoardConfig
from drake_tracker.world.disturbance_system import add_disturbance, sinusoid, step
from drake_tracker.world.imaging.camera_system import (
    Camera,
    CameraOptics,
    add_camera,
    add_late_cameras,
    add_renderer,
)
from drake_tracker.world.imaging.faulty_cameras_system import with_image_faults
from drake_tracker.world.imaging.lighting import overhead_render_engine_params


class BallWorldDiagram(BaseWorldDiagram):
    """Plant, release gate, camera and judge of the ball.

    .. pydrake_system::

        name: BallWorldDiagram
        input_ports:
        - arm_desired_state
        - arm_feedforward
        - ready
        output_ports:
        - camera
        - arm_state
        - arm_effort
        - truth_ball_state
        - truth_verdict
        - truth_query

    Inputs: ``arm_desired_state``, the joint set-points (q, v) [rad, rad/s]; ``arm_feedforward``, torques [N m];
    ``ready``, 1 once the arm waits for the ball.

    The controller may read ``camera``, an ImageRgba8U that is rendered when it is read, or that was captured some
    cycles earlier (``pipeline``); ``arm_state``, (q, v) [rad, rad/s]; and ``arm_effort``, the torques of the drives
    [N m]. Only judges, logs and viewers may read
    ``truth_ball_state``, the 13 numbers of the free body; ``truth_verdict``, a `CatchVerdict`, updated at 60 Hz from
    time 0 and all zeros before; and ``truth_query``, the scene.

    Args:
        config: common settings of all laboratories; the hand of the arm is a cup. Faults of images take effect.
        board: the board and its pegs.
        ball: where the ball starts, and whether it is released.
        camera: the camera and the ranges of its random pose.
        ball_on_board: False puts the ball aside and opens the gate, as while camera and board are initialised.

    Attributes: see `BaseWorldDiagram`.

    Raises DrakeTrackerError for a board on which things do not fit, or which the camera cannot see as a whole.
    """

    def __init__(
        self,
        config: WorldConfig,
        *,
        board: BoardConfig = BoardConfig(),
        ball: BallConfig = BallConfig(),
        camera: BoardCameraConfig = BoardCameraConfig(),
        ball_on_board: bool = True,
    ) -> None:
        super().__init__(config)
        builder = DiagramBuilder()
        self.laboratory = laboratory = add_ball_laboratory(
            builder,
            description=config.arm,
            board=board,
            ball=ball,
            seed=config.seed,
            time_step=config.time_step,
            ball_on_board=ball_on_board,
            decorate=add_floor,
        )
        plant = laboratory.plant
        self.place_robot(config)
        self.check_layout()
        release = add_release(
            builder,
            plant=plant,
            gate=laboratory.gate,
            delay=draw_delay(config.seed) if ball.release else np.inf,
            travel=GATE_TRAVEL,
            is_open=not ball_on_board,
        )
        if board.knock_time > 0.0:
            path = step(KNOCK, board.knock_time)
            add_disturbance(builder, plant=plant, slide=laboratory.board, name="knock", path=path)
        if laboratory.distractor is not None:
            path = sinusoid(SLIDE_AMPLITUDE)
            add_disturbance(builder, plant=plant, slide=laboratory.distractor, name="distractor", path=path)
        if config.windows is None or config.windows:
            self.cameras = {NAME: self._add_camera(builder, config, board, camera)}
        judge = add_catch_judge(builder, laboratory=laboratory, tool_frame=config.arm.tool_frame)

        self.export_robot(builder, config)
        builder.ExportInput(release.GetInputPort("ready"), "ready")
        builder.ExportOutput(plant.get_state_output_port(laboratory.ball), "truth_ball_state")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        builder.BuildInto(self)

    def _add_camera(
        self, builder: DiagramBuilder, config: WorldConfig, board: BoardConfig, camera: BoardCameraConfig
    ) -> Camera:
        """Adds the camera, with the faults of its images."""
        X_WB, scene_graph, lighting = self.laboratory.X_WB, self.laboratory.scene_graph, config.lighting
        params = overhead_render_engine_params(lighting, X_WB @ np.mean(face_corners(board), axis=0))
        optics = CameraOptics(
            X_WC=draw_camera_pose(camera, board=board, X_WB=X_WB, seed=config.seed),
            width=camera.width,
            height=camera.height,
            fov_deg=camera.fov_deg,
            window=None if config.windows is None else config.windows[NAME],
            supersampling=camera.supersampling,
            noise=camera.noise,
            flicker=lighting.flicker,
            flicker_hz=lighting.flicker_hz,
            seed=config.seed,
        )
        if config.pipeline is None:
            add_renderer(scene_graph, params=params)
            added = add_camera(builder, scene_graph=scene_graph, name=NAME, optics=optics)
        else:
            added = add_late_cameras(
                builder, scene_graph=scene_graph, optics={NAME: optics}, params=params, pipeline=config.pipeline
            )[NAME]
        return with_image_faults(builder, NAME, added, camera, config, view="both")
