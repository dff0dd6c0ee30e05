"""Trains a small network by imitation, and measures how often it succeeds beside the policies that it may compete with.

    drake-tracker dataset train:guided --no-images --policy guided --episodes 200 --first-seed 78000 -o lifts
    OPENBLAS_NUM_THREADS=1 python benchmarks/imitation.py lifts [--seeds N] [--json FILE]

The network learns the actions of the successful episodes of a data set (LeRobot's format v3.0). Its input is the last
0.75 s of the measured path and the tool, both in a frame that begins at the newest point and follows the path, so that
place and direction do not matter. Three lessons from development seeds (79900 and above): a network that sees the speed
of the tool or the opening of the jaws learns to go on as before, so that it gets the pose of the tool with noise, and
only whether the jaws are closed; heights are limited to those of the data set; and jaws that closed on nothing open
again. It is a multi-layer perceptron of scikit-learn, trained on the CPU. All policies run on the same seeds, 79000 and
above, which are not in the data set.
"""

import argparse
import json
import math
import time
from pathlib import Path

import gymnasium
import numpy as np
import pyarrow.parquet as pq
from result_tables.imitation_tables import imitation_table
from shared.common import print_table, save_json

from drake_tracker.environments import make_policy, run_episode

SCENARIO = "train:guided"
OVERRIDES = ["vision=!Measured {method: !SeveralObjects {}, outline: box}", "duration=30"]
FIRST_SEED, SEEDS = 79000, 40
STEPS = np.arange(16) * 0.05
"""Ages of the places on the path that the network sees, counted from the newest measured point [s]."""
OPEN, CLOSED, EMPTY = 0.088, 0.06, 0.03
"""Opening of open jaws; below the second one they count as closed, below the third one without a train [m]."""
RETREAT, HOVER = 0.8, 0.70
"""Time for which empty jaws open, and the height to which they go [s, m]."""
PLACE, TURN = slice(32, 34), slice(36, 38)
"""Inputs with the place and with the direction of the tool."""
NOISE = 0.01, 0.1
"""Their noise in two further copies of the samples [m, 1]."""
RIVALS = ("guided", "1991", "straight_line", "last_point")


def turned(x, y, angle):
    """Returns a vector in a frame that is turned by an angle."""
    c, s = math.cos(angle), math.sin(angle)
    return c * x + s * y, c * y - s * x


class Imitation:
    """A policy whose actions a network computes; without a network it only makes inputs and targets for training."""

    def __init__(self, network=None, heights=(0.0, 0.0)):
        self.network, self.heights = network, heights
        self.reset()

    def reset(self):
        self.path, self.retreats_until = np.zeros((0, 4)), 0.0

    def inputs(self, now, points, tool, width):
        """Returns the input of the network after new rows (stamp, x, y, z) of points, or None before the first."""
        new = [row for row in points if row[0] > (self.path[-1, 0] if len(self.path) else -1.0)]
        self.path = np.array([*self.path, *new])[-60:].reshape(-1, 4)
        if not len(self.path):
            return None
        self.origin = self.path[-1]
        x, y, z = (np.interp(self.origin[0] - STEPS, self.path[:, 0], self.path[:, column]) for column in (1, 2, 3))
        self.heading = math.atan2(y[0] - y[5], x[0] - x[5])
        path = turned(x - x[0], y - y[0], self.heading)
        place, twice = turned(*(tool[:2] - self.origin[1:3]), self.heading), 2.0 * (tool[3] - self.heading)
        rest = [tool[2], now - self.origin[0], math.cos(twice), math.sin(twice), z[0], float(width < CLOSED)]
        return np.concatenate([*path, place, rest])

    def target(self, action):
        """Returns what the network has to give for an action, after `inputs`."""
        place, twice = turned(*(action[:2] - self.origin[1:3]), self.heading), 2.0 * (action[3] - self.heading)
        return [*place, action[2], math.cos(twice), math.sin(twice), float(action[4] < CLOSED)]

    def act(self, observation):
        now, tool, width = observation["time"][0], observation["tool"], observation["jaws"][0]
        rows = [row for row, seen in zip(observation["tracks"], observation["seen"], strict=True) if seen > 0.0]
        seen = self.inputs(now, [points_in(row) for row in rows if row[4]], tool, width)
        if seen is None:
            return np.array([*tool, OPEN])
        x, y, z, c, s, closes = self.network(seen)
        yaw = 0.5 * math.atan2(s, c) + self.heading
        yaw += math.pi * round((tool[3] - yaw) / math.pi)  # the jaws are the same after half a turn
        x, y = turned(x, y, -self.heading)
        self.retreats_until = now + RETREAT if width < EMPTY else self.retreats_until
        z, width = np.clip(z, *self.heights), 0.0 if closes > 0.5 else OPEN
        z, width = (HOVER, OPEN) if now < self.retreats_until else (z, width)
        return np.array([x + self.origin[1], y + self.origin[2], z, yaw, width])


def points_in(row):
    """Returns (stamp, x, y, z) of the first track of a message of tracks."""
    return row[[0, 7, 8, 9]]


def samples(folder):
    """Returns inputs, targets and the number of episodes that were used: the successful ones."""
    names = json.loads((folder / "meta/info.json").read_text())["features"]
    measured = names["observation.environment_state"]["names"]
    first = [measured.index(f"tracks.{name}.0") for name in ("stamp", "x0", "y0", "z0")]
    per_row = measured.index("tracks.stamp.1") - first[0]
    state = names["observation.state"]["names"]
    tool, jaws = state.index("tool.x"), state.index("jaws.width")
    inputs, targets, episodes = [], [], 0
    for file in sorted(folder.glob("data/*/*.parquet")):
        table = pq.read_table(file).to_pydict()
        if not table["next.success"][-1]:
            continue
        policy, episodes = Imitation(), episodes + 1
        for now, vision, joints, action in zip(
            table["observation.time"],
            np.array(table["observation.environment_state"]),
            np.array(table["observation.state"]),
            np.array(table["action"]),
            strict=True,
        ):
            rows = [vision[np.array(first) + k * per_row] for k in range(2) if vision[k] > 0.0]
            seen = policy.inputs(now, rows, joints[tool : tool + 4], joints[jaws])
            if seen is not None:
                inputs.append(seen)
                targets.append(policy.target(action))
    return np.array(inputs), np.array(targets), episodes


def train(inputs, targets):
    """Returns the trained network as a function of an input."""
    from sklearn.neural_network import MLPRegressor  # only here, so that tests of the policy need no scikit-learn
    from sklearn.preprocessing import StandardScaler

    rng, copies = np.random.default_rng(0), [inputs]
    for _ in range(2):
        copies.append(inputs.copy())
        for columns, std in zip((PLACE, TURN), NOISE, strict=True):
            copies[-1][:, columns] += rng.normal(0.0, std, (len(inputs), 2))
    inputs, targets = np.concatenate(copies), np.concatenate([targets] * len(copies))
    scale_in, scale_out = StandardScaler().fit(inputs), StandardScaler().fit(targets)
    network = MLPRegressor(
        hidden_layer_sizes=(256, 256), early_stopping=True, max_iter=200, n_iter_no_change=15, random_state=0
    )
    network.fit(scale_in.transform(inputs), scale_out.transform(targets))
    return lambda seen: scale_out.inverse_transform(network.predict(scale_in.transform(seen[None])))[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder that drake-tracker dataset wrote")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"episodes per policy (default {SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    start = time.monotonic()
    inputs, targets, episodes = samples(options.data)
    network, heights = train(inputs, targets), (targets[:, 2].min(), targets[:, 2].max())
    found = {"episodes": episodes, "samples": len(inputs), "training_s": time.monotonic() - start, "rows": []}
    print(f"{episodes} episodes, {len(inputs)} samples, {found['training_s']:.0f} s", flush=True)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    for name in ("imitation", *RIVALS):
        env, reasons = gymnasium.make("drake_tracker/Train-v0", scenario=SCENARIO, overrides=OVERRIDES), []
        policy = Imitation(network, heights) if name == "imitation" else make_policy(name, env)
        for seed in seeds:
            outcome = run_episode(env, policy, seed)
            reasons.append(None if outcome["success"] else outcome["reason"])
            print(f"{name} seed {seed}: {outcome['reason']}", flush=True)
        env.close()
        found["rows"].append({"policy": name, "scenario": SCENARIO, "runs": len(reasons), "reasons": reasons})
    print_table(*imitation_table(found))
    save_json(found, options.json, seeds)


if __name__ == "__main__":
    main()
