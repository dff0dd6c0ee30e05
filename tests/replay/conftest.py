"""Short runs to replay: a train with measured vision, and a train and a ball with recorded images."""

import pytest
from ball_scenario import true_poses

from drake_tracker.grasp.config import CatchConfig
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario


def make_run(out, spec, duration, overrides, images=False, initialise=lambda scenario: None):
    scenario = load_scenario(spec, duration=duration, overrides=overrides)
    simulate(scenario, out, RunOptions(record=False, images=images), initialisation=initialise(scenario))


@pytest.fixture(scope="session")
def measured_run(record_once):
    """A run with a link that loses packets, long enough for predictions."""
    overrides = ["vision=!Measured {}", "link=!Lossy {drop: 0.2, jitter: 0.03}"]
    return record_once("replay_measured", lambda out: make_run(out, "train:learned", 2.5, overrides))


@pytest.fixture(scope="session")
def rendered_run(record_once):
    return record_once("replay_rendered", lambda out: make_run(out, "train:learned", 2.5, [], images=True))


@pytest.fixture(scope="session")
def several_run(record_once):
    """A run whose vision tracks two trains, and whose images other processes render."""
    overrides = [
        "objects=[!Train {}]",
        "vision.method=!SilhouetteTracker {confirm_after: 3}",
        "cameras.render_processes=1",
    ]
    return record_once("replay_several", lambda out: make_run(out, "train:guided", 2.5, overrides, images=True))


@pytest.fixture(scope="session")
def ball_run(record_once):
    """A run in which the ball rolls at once: the poses of the board are given, without the initialisation."""
    overrides = ["catch.ready_after=0", "vision.update_cycles=2"]
    overrides += ["camera.supersampling=1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CatchConfig, "home_duration", 0.2)
        return record_once(
            "replay_ball", lambda out: make_run(out, "ball", 2.0, overrides, images=True, initialise=true_poses)
        )
