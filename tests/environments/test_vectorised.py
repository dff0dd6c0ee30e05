"""Tests of several environments in processes."""

import gymnasium
import numpy as np

from drake_tracker.environments.environment import TrackerEnvironment

OVERRIDES = ["vision=!Measured {}", "duration=0.3"]
SEEDS = (3, 4)


def action(k):
    return np.array([0.56, 0.1 * np.sin(0.2 * k), 0.66, np.pi, 0.03])


def alone(seed):
    """Returns the observations of an episode in an environment of this process."""
    env = TrackerEnvironment(overrides=OVERRIDES)
    observations, truncated = [env.reset(seed=seed)[0]], False
    while not truncated:
        observation, _, _, truncated, _ = env.step(action(len(observations)))
        observations.append(observation)
    return observations


def test_environments_in_processes_have_the_episodes_of_their_seeds_and_begin_new_ones():
    settings = {"num_envs": len(SEEDS), "vectorization_mode": "async", "overrides": OVERRIDES}
    envs = gymnasium.make_vec("drake_tracker/Train-v0", **settings)
    observations, truncated = [envs.reset(seed=SEEDS)[0]], np.zeros(len(SEEDS), bool)
    while not truncated.any():
        observation, _, _, truncated, info = envs.step(np.tile(action(len(observations)), (len(SEEDS), 1)))
        observations.append(observation)
    for k, seed in enumerate(SEEDS):
        expected = alone(seed)
        for name in expected[0]:
            together = [observation[name][k] for observation in observations]
            assert np.array_equal([observation[name] for observation in expected], together), name
    assert truncated.all() and info["reproducible"].all()
    later, _, _, truncated, _ = envs.step(np.tile(action(0), (len(SEEDS), 1)))  # begins new episodes
    assert not truncated.any() and (later["time"] < 0.03).all()
    processes = envs.processes
    envs.close()
    assert not any(process.is_alive() for process in processes)
