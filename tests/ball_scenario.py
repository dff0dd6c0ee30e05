"""The ball's scenario with a few of its settings changed: a camera without noise unless told otherwise."""

from drake_tracker.scenarios.ball_scenario import BallScenario


def make_scenario(seed=0, noise=0.0, start_x=None, release=True, **board):
    scenario = BallScenario(seed=seed)
    scenario.camera.noise = noise
    scenario.ball.start_x = start_x
    scenario.ball.release = release
    for key, value in board.items():
        assert hasattr(scenario.board, key), key
        setattr(scenario.board, key, value)
    return scenario
