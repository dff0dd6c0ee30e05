"""Measures the speed of the environment `Train-v0`, and whether episodes depend on the load of the machine.

    OPENBLAS_NUM_THREADS=1 python benchmarks/environment_speed.py [--episodes N] [--json FILE]

Speed: steps per second, with measured points and with two rendered cameras, of one environment and summed over two, and
the time from the import to the first observation after the first step. The tool keeps its place.

Equality: the observations and rewards of 100 episodes of 1 s with random actions have a hash each. The episodes are run
alone, beside two busy processes per core, and two at a time in `gymnasium.make_vec`. The hashes must be the same.
"""

import argparse
import hashlib
import multiprocessing
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import gymnasium
import numpy as np
from result_tables.speed_tables import environment_table
from shared.common import print_table, save_json

import drake_tracker.environments  # noqa: F401  (registers the environments)

NAME = "drake_tracker/Train-v0"
POINTS = {
    "scenario": "train:guided",
    "overrides": ["vision=!Measured {method: !SeveralObjects {}, outline: box}", "duration=60"],
}
IMAGES = {"scenario": "train:guided", "overrides": ["duration=60"], "observe": ("joints", "images")}
FIRST_SEED, STEPS, TURNS = 77000, 33, 5
PERIOD = 0.03
"""Simulated time of a step [s]."""
FIRST_STEP = """
import time
start = time.perf_counter()
import gymnasium, drake_tracker.environments
env = gymnasium.make("drake_tracker/Train-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.perf_counter() - start)
env.close()
"""


def actions_of(seed):
    """Returns the actions of an episode, near a place above the track, shape (`STEPS`, 5)."""
    rng = np.random.default_rng(seed)
    return np.array([0.5, 0.0, 0.65, 0.0, 0.08]) + rng.uniform(-1.0, 1.0, (STEPS, 5)) * [0.1, 0.1, 0.05, 1.0, 0.008]


def hashed(digest, observation, number=None):
    """Adds an observation to a hash: the one of environment ``number`` where there are several."""
    for name in sorted(observation):
        values = observation[name] if number is None else observation[name][number]
        digest.update(np.ascontiguousarray(values).tobytes())


def hashes_alone(seeds):
    """Returns the hash of each episode, run one after the other."""
    env, found = gymnasium.make(NAME, **POINTS), []
    for seed in seeds:
        digest = hashlib.sha256()
        hashed(digest, env.reset(seed=seed)[0])
        for action in actions_of(seed):
            observation, reward, *_ = env.step(action)
            hashed(digest, observation)
            digest.update(np.float64(reward).tobytes())
        found.append(digest.hexdigest())
    env.close()
    return found


def hashes_in_pairs(seeds):
    """Returns the hash of each episode, run two at a time in processes."""
    envs, found = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="async", **POINTS), []
    for first in range(0, len(seeds) - 1, 2):
        pair = list(seeds[first : first + 2])
        digests = [hashlib.sha256(), hashlib.sha256()]
        observation = envs.reset(seed=pair)[0]
        for number, digest in enumerate(digests):
            hashed(digest, observation, number)
        for actions in zip(*map(actions_of, pair), strict=True):
            observation, rewards, *_ = envs.step(np.array(actions))
            for number, digest in enumerate(digests):
                hashed(digest, observation, number)
                digest.update(np.float64(rewards[number]).tobytes())
        found += [digest.hexdigest() for digest in digests]
    envs.close()
    return found


def busy():
    """Keeps a processor busy."""
    while True:
        np.linalg.inv(np.random.default_rng(0).normal(size=(200, 200)))


def equal_hashes(episodes):
    """Returns {condition: number of episodes with the hash that they have alone}."""
    seeds = range(FIRST_SEED, FIRST_SEED + episodes)
    alone = hashes_alone(seeds)
    print("run alone", flush=True)
    load = [multiprocessing.Process(target=busy, daemon=True) for _ in range(2 * (os.cpu_count() or 1))]
    for process in load:
        process.start()
    loaded = hashes_alone(seeds)
    for process in load:
        process.kill()
    print("run beside busy processes", flush=True)
    paired = hashes_in_pairs(seeds)
    return {
        "beside two busy processes per core": sum(map(str.__eq__, alone, loaded)),
        "two at a time": sum(map(str.__eq__, alone, paired)),
    }


def speeds(options, number):
    """Returns the steps per second of each turn, summed over environments."""
    if number == 1:
        env = gymnasium.make(NAME, **options)
    else:
        env = gymnasium.make_vec(NAME, num_envs=number, vectorization_mode="async", **options)
    env.reset(seed=FIRST_SEED if number == 1 else [FIRST_SEED + k for k in range(number)])
    hold = np.array([0.5, 0.0, 0.65, 0.0, 0.08])
    hold, found = hold if number == 1 else np.tile(hold, (number, 1)), []
    for turn in range(TURNS + 1):
        start = time.perf_counter()
        for _ in range(100):
            env.step(hold)
        if turn:  # the first one warms up
            found.append(number * 100 / (time.perf_counter() - start))
    env.close()
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=100, help="whose hashes are compared (default 100)")
    parser.add_argument("--json", type=Path, help="file for the results")
    options = parser.parse_args()
    first = [float(subprocess.check_output([sys.executable, "-c", FIRST_STEP], text=True)) for _ in range(TURNS)]
    rates = {
        f"{what}, {number} environment{'s' * (number > 1)}": speeds(settings, number)
        for what, settings in (("points", POINTS), ("two cameras", IMAGES))
        for number in (1, 2)
    }
    found = {
        "first_step_s": first,
        "steps_per_s": rates,
        "real_time_factor": {name: PERIOD * statistics.median(values) for name, values in rates.items()},
        "episodes": options.episodes,
        "equal": equal_hashes(options.episodes),
    }
    print_table(*environment_table(found))
    save_json(found, options.json, list(range(FIRST_SEED, FIRST_SEED + options.episodes)))


if __name__ == "__main__":
    main()
