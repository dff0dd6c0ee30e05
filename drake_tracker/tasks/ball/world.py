"""The laboratory of a run of the ball."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.arm.description import Arm
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.world.ball_world_diagram import BallWorldDiagram


def make_ball_world(
    scenario: BallScenario,
    *,
    description: Arm,
    q_initial: Sequence[float] | np.ndarray,
    ball_on_board: bool = True,
    with_camera: bool = True,
) -> BallWorldDiagram:
    """Returns the `BallWorldDiagram` of a scenario.

    Args:
        scenario: its settings of the board, the ball, the camera and the light.
        description: an arm whose hand is a cup.
        q_initial: joints at the start [rad].
        ball_on_board: False puts the ball aside and opens the gate, as while camera and board are initialised.
        with_camera: False: no camera and no renderer.
    """
    return BallWorldDiagram(
        description=description,
        q_initial=q_initial,
        board=scenario.board,
        ball=scenario.ball,
        camera=scenario.camera if with_camera else None,
        lighting=scenario.lighting,
        ball_on_board=ball_on_board,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
