"""The laboratory of the ball as a Diagram: everything that is real, and the only place that holds the ground truth."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.core.timing import BALL_TIME_STEP
from drake_tracker.faults.fault import Fault, FaultyView
from drake_tracker.faults.image_faults_system import add_image_faults
from drake_tracker.world.ball.ball_board import face_corners
from drake_tracker.world.ball.ball_camera import NAME, draw_camera_pose
from drake_tracker.world.ball.ball_fixtures import GATE_TRAVEL, KNOCK, SLIDE_AMPLITUDE
from drake_tracker.world.ball.ball_plant import add_ball_laboratory, add_floor
from drake_tracker.world.ball.catch_judge_system import add_catch_judge
from drake_tracker.world.ball.release_system import add_release, draw_delay
from drake_tracker.world.config import BallConfig, BoardCameraConfig, BoardConfig, LightingConfig
from drake_tracker.world.disturbance_system import add_disturbance, sinusoid, step
from drake_tracker.world.imaging.camera_system import (
    Camera,
    CameraOptics,
    add_camera,
    add_late_cameras,
    add_renderer,
    close_cameras,
    start_cameras,
)
from drake_tracker.world.imaging.cameras import ImageWindow, true_camera_model
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.imaging.lighting import overhead_render_engine_params


class BallWorldDiagram(Diagram):
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
        description: an arm whose hand is a cup.
        q_initial: joints at the start [rad].
        board: the board and what stands on it.
        ball: where the ball starts, and whether it is released.
        camera: the camera and the ranges of its random pose; None: no camera, no port ``camera`` and no renderer.
        lighting: the lamps.
        window: part of the image to render; None renders all of it.
        pipeline: how late the images are, and which processes make them; None: they are rendered when they are read.
        wanted: with a pipeline, whether the image of a cycle is likely to be read.
        ball_on_board: False puts the ball aside and opens the gate, as while camera and board are initialised.
        faults: what goes wrong; of these, the world has those of the images.
        seed: of every random draw.
        time_step: of the plant [s].

    Attributes:
        laboratory: the plant and its parts: ground truth.
        camera: `Camera`, or None without one: ground truth.
        image_latency: cycles from the capture of an image until its port shows it.

    Raises DrakeTrackerError for a board on which things do not fit, or which the camera cannot see as a whole.
    """

    def __init__(
        self,
        *,
        description: ArmDescription,
        q_initial: Sequence[float] | np.ndarray,
        board: BoardConfig = BoardConfig(),
        ball: BallConfig = BallConfig(),
        camera: BoardCameraConfig | None = BoardCameraConfig(),
        lighting: LightingConfig = LightingConfig(),
        window: ImageWindow | None = None,
        pipeline: ImagePipeline | None = None,
        wanted: Callable[[int], bool] = lambda cycle: True,
        ball_on_board: bool = True,
        faults: Sequence[Fault] = (),
        seed: int = 0,
        time_step: float = BALL_TIME_STEP,
    ) -> None:
        super().__init__()
        self.set_name("world")
        builder = DiagramBuilder()
        laboratory = add_ball_laboratory(
            builder,
            description=description,
            board=board,
            ball=ball,
            seed=seed,
            time_step=time_step,
            ball_on_board=ball_on_board,
            decorate=add_floor,
        )
        plant = laboratory.plant
        plant.set_name("plant")
        plant.SetDefaultPositions(laboratory.arm, q_initial)
        release = add_release(
            builder,
            plant=plant,
            gate=laboratory.gate,
            delay=draw_delay(seed) if ball.release else np.inf,
            travel=GATE_TRAVEL,
            is_open=not ball_on_board,
        )
        if board.knock_time > 0.0:
            add_disturbance(
                builder,
                plant=plant,
                slide=laboratory.board,
                name="knock",
                path=step(KNOCK, board.knock_time),
            )
        if laboratory.distractor is not None:
            add_disturbance(
                builder, plant=plant, slide=laboratory.distractor, name="distractor", path=sinusoid(SLIDE_AMPLITUDE)
            )
        self.laboratory = laboratory
        self.image_latency = 0 if pipeline is None else pipeline.latency
        self.camera: Camera | None = None
        if camera is not None:
            look_at = laboratory.X_WB @ np.mean(face_corners(board), axis=0)
            params = overhead_render_engine_params(lighting, look_at)
            optics = CameraOptics(
                X_WC=draw_camera_pose(camera, board=board, X_WB=laboratory.X_WB, seed=seed),
                width=camera.width,
                height=camera.height,
                fov_deg=camera.fov_deg,
                window=window,
                supersampling=camera.supersampling,
                noise=camera.noise,
                flicker=lighting.flicker,
                flicker_hz=lighting.flicker_hz,
                seed=seed,
            )
            scene_graph = laboratory.scene_graph
            if pipeline is None:
                add_renderer(scene_graph, params=params)
                self.camera = add_camera(builder, scene_graph=scene_graph, name=NAME, optics=optics)
            else:
                self.camera = add_late_cameras(
                    builder,
                    scene_graph=scene_graph,
                    optics={NAME: optics},
                    params=params,
                    pipeline=pipeline,
                    wanted=wanted,
                )[NAME]
            self.camera = replace(
                self.camera,
                image_port=add_image_faults(
                    builder,
                    image_port=self.camera.image_port,
                    view=FaultyView("both", true_camera_model(camera, self.camera.X_WC), self.camera.window),
                    faults=faults,
                    latency=self.image_latency,
                    name=f"{NAME}_faults",
                ),
            )
        judge = add_catch_judge(builder, laboratory=laboratory, tool_frame=description.tool_frame)

        builder.ExportInput(plant.get_desired_state_input_port(laboratory.arm), "arm_desired_state")
        builder.ExportInput(plant.get_actuation_input_port(laboratory.arm), "arm_feedforward")
        builder.ExportInput(release.GetInputPort("ready"), "ready")
        if self.camera is not None:
            builder.ExportOutput(self.camera.image_port, NAME)
        builder.ExportOutput(plant.get_state_output_port(laboratory.arm), "arm_state")
        builder.ExportOutput(plant.get_net_actuation_output_port(laboratory.arm), "arm_effort")
        builder.ExportOutput(plant.get_state_output_port(laboratory.ball), "truth_ball_state")
        builder.ExportOutput(judge.GetOutputPort("verdict"), "truth_verdict")
        builder.ExportOutput(laboratory.scene_graph.get_query_output_port(), "truth_query")
        builder.BuildInto(self)

    def start(self) -> None:
        """Starts the processes that make images, if there are any, which otherwise start with the first image."""
        if self.camera is not None:
            start_cameras([self.camera])

    def close(self) -> None:
        """Ends the processes that make images, if there are any. They start again when an image is read."""
        if self.camera is not None:
            close_cameras([self.camera])
