"""Makes the laboratory of the ball from a scenario."""

from collections.abc import Callable, Sequence

import numpy as np

from drake_tracker.arm.description import Arm
from drake_tracker.faults.fault import Fault
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.world.ball.ball_world_diagram import BallWorldDiagram
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.imaging.image_pipeline import ImagePipeline


def make_ball_world(
    scenario: BallScenario,
    *,
    description: Arm,
    q_initial: Sequence[float] | np.ndarray,
    ball_on_board: bool = True,
    with_camera: bool = True,
    window: ImageWindow | None = None,
    pipeline: ImagePipeline | None = None,
    wanted: Callable[[int], bool] = lambda cycle: True,
    faults: Sequence[Fault] = (),
) -> BallWorldDiagram:
    """Returns the laboratory of a scenario.

    Args:
        scenario: the scenario.
        description: an arm whose hand is a cup.
        q_initial: joints at the start [rad], shape (n,).
        ball_on_board: whether the ball starts on the board. Otherwise it lies aside and the gate is open, as during the
            initialisation.
        with_camera: whether to add the camera and its renderer.
        window: part of the image to render; None renders all of it.
        pipeline: how the images are made beside the simulation; None: they are rendered when they are read.
        wanted: with a pipeline, whether the image of a cycle is likely to be read.
        faults: what goes wrong.
    """
    return BallWorldDiagram(
        description=description,
        q_initial=q_initial,
        board=scenario.board,
        ball=scenario.ball,
        camera=scenario.camera if with_camera else None,
        lighting=scenario.lighting,
        window=window,
        pipeline=pipeline,
        wanted=wanted,
        ball_on_board=ball_on_board,
        faults=faults,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
