"""Counts the jumps of trains on tracks that cross or touch themselves.

    python benchmarks/crossing_tracks.py [--tracks N] [--json FILE]

Each track is a file of points, rounded to 10 um. A train without arm and cameras runs along it once, with the physics
of the task: plant, rail and wheels. Kinds of tracks, in turns:

- walk: 2 m of straights of 50 mm and corners of 10 mm radius in a square of 140 mm;
- figure eight: a lemniscate, which crosses itself;
- Lissajous: a curve of up to seven crossings;
- double loop: two laps side by side in the same direction, 1 to 40 mm apart, which cross at a small angle.

A jump is a step of the place on the track, from image to image, backwards or of more than twice the distance that the
speed allows, a place that differs by more than 50 mm from the distance that the train has covered, or a train more than
10 mm beside its track. (The train passes corners up to 1 mm outside, which adds some 30 mm to 2 m.) ``memoryless``
counts the tracks on which a search of the whole track, for the same true poses, steps back or ahead in this way.
"""

import argparse
import itertools
import math
import tempfile
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from shared.common import print_table, save_json

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_plant, add_table, train_pose
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.tracks import make_track
from drake_tracker.world.train.train_model import add_train

SEED = 9700
"""Seed of the first track; each track has its own."""
CENTRE = (0.56, 0.0)
TABLE = 0.45
SPEEDS = (0.15, 0.35)
"""Range from which the speed is drawn [m/s]."""
SQUARE, STRAIGHT, RADIUS, WALK = 0.14, 0.05, 0.01, 2.0
"""Of a walk [m]."""
SLACK = 0.002
"""Step of the place that is never a jump [m]."""
MOST_DEVIATION, MOST_ASIDE = 0.05, 0.01
"""Largest distance of the place from the distance covered, and of the train from its track [m]."""


def walk(rng, area=(SQUARE, SQUARE), turns=(30.0, 150.0), straights=None):
    """Returns points every 2 mm of an open walk around the origin that crosses and touches itself, and whether it is
    closed.

    Args:
        rng: the random numbers.
        area: extent along x and y of the rectangle in which it stays [m].
        turns: smallest and largest turn of a corner, to either side [deg].
        straights: shortest and longest straight [m]; None: all have the length `STRAIGHT`.
    """
    step, place, heading = 0.002, np.zeros(2), rng.uniform(-math.pi, math.pi)
    pieces, length = [], 0.0
    while length < WALK:
        for _ in range(100):
            turn = 0.0 if not pieces else rng.choice((-1.0, 1.0)) * math.radians(rng.uniform(*turns))
            straight = STRAIGHT if straights is None else rng.uniform(*straights)
            arc = _arc(place, heading, turn)
            end = (arc[-1] if len(arc) else place) + straight * _direction(heading + turn)
            if (np.abs(np.vstack([arc, [end]])) < 0.5 * np.array(area)).all():
                break
        else:
            return walk(rng, area, turns, straights)
        start = arc[-1] if len(arc) else place
        pieces += [
            arc,
            start + np.linspace(0.0, straight, round(straight / step) + 1)[1:, None] * (end - start) / straight,
        ]
        place, heading, length = end, heading + turn, length + RADIUS * abs(turn) + straight
    return np.concatenate(pieces), False


def _arc(place, heading, turn):
    """Returns points about every 2 mm of a corner, without its beginning."""
    if turn == 0.0:
        return np.empty((0, 2))
    side = math.copysign(RADIUS, turn)
    centre = place + side * _direction(heading + 0.5 * math.pi)
    angles = heading + turn * np.linspace(0.0, 1.0, math.ceil(RADIUS * abs(turn) / 0.002) + 1)[1:]
    return centre - side * np.column_stack([-np.sin(angles), np.cos(angles)])


def _direction(heading):
    return np.array([math.cos(heading), math.sin(heading)])


def figure_eight(rng):
    """Returns points of a closed lemniscate that crosses itself in its middle."""
    u = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    a, b = rng.uniform(0.03, 0.15), rng.uniform(0.1, 0.25)
    scale = 1.0 / (1.0 + np.cos(u) ** 2)
    return np.column_stack([a * math.sqrt(8) * np.sin(u) * np.cos(u) * scale, b * np.sin(u) * scale]), True


def lissajous(rng):
    """Returns points of a closed curve that crosses itself several times."""
    u = np.linspace(0.0, 2.0 * math.pi, 600, endpoint=False)
    p, q = ((1, 2), (2, 3), (3, 2))[rng.integers(3)]
    a, b, phase = rng.uniform(0.06, 0.15), rng.uniform(0.06, 0.2), rng.uniform(0.0, math.pi)
    return np.column_stack([a * np.sin(p * u + phase), b * np.sin(q * u)]), True


def double_loop(rng):
    """Returns points of a closed curve of two laps that cross at a small angle."""
    u = np.linspace(0.0, 4.0 * math.pi, 600, endpoint=False)
    r = rng.uniform(0.08, 0.15) + math.exp(rng.uniform(math.log(0.0005), math.log(0.02))) * np.cos(0.5 * u)
    return np.column_stack([r * np.cos(u), r * np.sin(u)]), True


KINDS = {"walk": walk, "figure eight": figure_eight, "Lissajous": lissajous, "double loop": double_loop}


def drawn(kind, rng, file):
    """Returns a track of a kind, read from a file; one that bends too tightly is drawn again."""
    while True:
        points, closed = KINDS[kind](rng)
        np.savetxt(file, points + CENTRE, "%.5f", ",", header="x,y", comments="")
        try:
            return make_track("csv", csv=str(file), closed=closed)
        except DrakeTrackerError:
            assert kind != "walk", "its corners are allowed"


def travel(track, speed, share=1.0):
    """Simulates a train for a share of its track. Returns rows (time, place, x, y, heading, speed) per image."""
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, time_step=TIME_STEP)
    add_table(plant, height=TABLE)
    train = add_train(plant)
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("train"), train_pose(track, 0.0, TABLE))
    rail = add_rail(builder, plant=plant, train=train, ride=Ride(track, speed=speed), height=TABLE + TRAIN_HEIGHT)
    simulator = Simulator(builder.Build())
    root = simulator.get_context()
    rows = []
    for k in itertools.count():
        if k * VISION_PERIOD > share * track.length / speed:
            return np.array(rows)
        simulator.AdvanceTo(k * VISION_PERIOD)
        qw, _, _, qz, x, y, _, _, _, _, vx, vy, _ = plant.get_state_output_port(train).Eval(
            plant.GetMyContextFromRoot(root)
        )
        (place,) = rail.GetMyContextFromRoot(root).get_discrete_state(0).value()
        rows.append((root.get_time(), place, x, y, 2.0 * math.atan2(qz, qw), math.hypot(vx, vy)))


def steps_of(track, places):
    """Returns the steps from place to place [m]; those of a closed track are taken the short way."""
    steps = np.diff(places)
    return (steps + 0.5 * track.length) % track.length - 0.5 * track.length if track.closed else steps


def judged(track, speed, rows):
    """Returns the numbers of a run of a train."""
    times, places, x, y, heading, speeds = rows.T
    rails_x, rails_y, _ = track.pose(places)
    steps = steps_of(track, places)
    covered = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))])
    deviation = np.abs(np.concatenate([[0.0], np.cumsum(steps)]) - covered).max()
    aside = np.hypot(x - rails_x, y - rails_y).max()
    anywhere = steps_of(track, np.array([track.nearest(*each)[0] for each in zip(x, y, heading)]))
    longest = 2.0 * speed * VISION_PERIOD + SLACK

    def jumps(taken):
        return int(np.sum(~((taken > -SLACK) & (taken < longest))))

    return {
        "length_m": track.length,
        "speed": speed,
        "jumps": jumps(steps) + int(not (deviation < MOST_DEVIATION and aside < MOST_ASIDE)),
        "memoryless": jumps(anywhere),
        "deviation_mm": 1e3 * float(deviation),
        "aside_mm": 1e3 * float(aside),
    }


def measure(count):
    """Returns {kind: list of the numbers of its tracks}."""
    found = {kind: [] for kind in KINDS}
    with tempfile.TemporaryDirectory() as folder:
        for number, kind in zip(range(count), itertools.cycle(KINDS)):
            rng = np.random.default_rng([SEED + number])
            track, speed = drawn(kind, rng, Path(folder) / "track.csv"), float(rng.uniform(*SPEEDS))
            found[kind].append({"seed": SEED + number, **judged(track, speed, travel(track, speed))})
    return found


def table(found):
    """Returns (header, rows) of the results."""
    header = ["tracks", "number", "with jumps", "memoryless", "largest deviation", "farthest from the track"]
    return header, [
        [
            kind,
            len(rows),
            sum(row["jumps"] > 0 for row in rows),
            sum(row["memoryless"] > 0 for row in rows),
            f"{max(row['deviation_mm'] for row in rows):.1f} mm",
            f"{max(row['aside_mm'] for row in rows):.1f} mm",
        ]
        for kind, rows in found.items()
        if rows
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", type=int, default=200, help="number of tracks (default: 200)")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    found = measure(options.tracks)
    print_table(*table(found))
    save_json({"tracks": found}, options.json, range(SEED, SEED + options.tracks))


if __name__ == "__main__":
    main()
