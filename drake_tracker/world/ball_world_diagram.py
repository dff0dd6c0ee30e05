"""The laboratory of the ball as a Diagram: everything that is real, and the only place where truth lives."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.world.ball_board import face_corners
from drake_tracker.world.ball_camera import NAME, add_ball_camera, draw_camera_pose
from drake_tracker.world.ball_fixtures import GATE_TRAVEL, KNOCK, SLIDE_AMPLITUDE
from drake_tracker.world.ball_plant import add_ball_laboratory, add_floor
from drake_tracker.world.catch_judge_system import CatchJudgeSystem
from drake_tracker.world.disturbance_system import DisturbanceSystem
from drake_tracker.world.release_system import ReleaseSystem, draw_delay


class BallWorldDiagram(Diagram):
    """Plant, release gate, camera and judge.

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

    Inputs: joint set-points (q, v), feed-forward torques [N m], and ``ready``, 1 once the arm waits for the ball.
    ``camera`` is an ImageRgba8U at 60 Hz, ``arm_state`` is (q, v), ``arm_effort`` the drives' torques [N m]: these may
    be read by the controller. The ``truth_*`` ports, the ball's 13 numbers, a `CatchVerdict` and the scene, are for
    judges, logs and viewers alone; so are the attributes ``laboratory`` and ``camera``, None without a camera.

    Args:
      scenario: fields board, ball, camera, lighting, seed, time_step. description: an `ArmDescription` with a cup.
      q_initial: the arm's start [rad]. window: (u0, v0, width, height) [px] to render, None for the whole image.
      with_camera: False: without the port ``camera`` and without a renderer.
      ball_on_board: False: the ball lies aside and the gate stands open, as while camera and board are initialised.
    """

    def __init__(self, scenario, description, q_initial, window=None, with_camera=True, ball_on_board=True):
        super().__init__()
        self.set_name("world")
        builder = DiagramBuilder()
        laboratory = add_ball_laboratory(builder, description, scenario, ball_on_board, decorate=add_floor)
        plant = laboratory.plant
        plant.set_name("plant")
        plant.SetDefaultPositions(laboratory.arm, q_initial)
        delay = draw_delay(scenario.seed) if scenario.ball.release else np.inf
        release = builder.AddNamedSystem("release", ReleaseSystem(delay, GATE_TRAVEL, is_open=not ball_on_board))
        builder.Connect(
            release.GetOutputPort("gate_desired_state"), plant.get_desired_state_input_port(laboratory.gate)
        )
        if scenario.board.knock_time > 0.0:
            knock = builder.AddNamedSystem("knock", DisturbanceSystem(KNOCK, step_time=scenario.board.knock_time))
            builder.Connect(knock.get_output_port(), plant.get_desired_state_input_port(laboratory.board))
        if laboratory.distractor is not None:
            distractor = builder.AddNamedSystem("distractor", DisturbanceSystem(SLIDE_AMPLITUDE))
            builder.Connect(distractor.get_output_port(), plant.get_desired_state_input_port(laboratory.distractor))
        self.camera = None
        if with_camera:
            X_WC = draw_camera_pose(scenario.camera, scenario.board, laboratory.X_WB, scenario.seed)
            self.camera = add_ball_camera(
                builder,
                laboratory.scene_graph,
                scenario.camera,
                scenario.lighting,
                X_WC,
                laboratory.X_WB @ np.mean(face_corners(scenario.board), axis=0),
                window=window,
                seed=scenario.seed,
            )
        judge = builder.AddNamedSystem("judge", CatchJudgeSystem(laboratory, description.tool_frame))
        builder.Connect(plant.get_contact_results_output_port(), judge.GetInputPort("contact_results"))
        builder.Connect(plant.get_body_poses_output_port(), judge.GetInputPort("body_poses"))
        builder.Connect(plant.get_state_output_port(laboratory.ball), judge.GetInputPort("ball_state"))

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
        self.laboratory = laboratory
        builder.BuildInto(self)
