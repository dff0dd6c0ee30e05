"""Measures how well the cameras of the conveyor see the parts, by kind of part and by motion of the belt.

    python benchmarks/conveyor_vision.py                     all cells, on two processes; resumes
    python benchmarks/conveyor_vision.py --cells "0.40 m/s"  one cell
    python benchmarks/conveyor_vision.py --quick             a trial on seeds of its own; nothing is written

Every run has 40 s with cameras and 15 parts a minute, which the arm picks as usual. The poses that vision reports are
compared with the true ones of the same instant, as long as a part lies on the belt. Seeds 5500 to 5599 are used nowhere
else.
"""

import tempfile
from pathlib import Path

import numpy as np
from methods.part_vision_errors import vision_errors
from shared import common, parts
from shared.parts import Part

from drake_tracker import simulate
from drake_tracker.core.log import load_log
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.conveyor.setup import resolve

RESULTS = common.RESULTS / "conveyor_vision.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "conveyor_vision"
DURATION, RATE, RUNS = 40.0, 15.0, 10
CELLS = {
    **{f"{speed:.2f} m/s": [f"belt.speed={speed}"] for speed in (0.05, 0.10, 0.15, 0.20, 0.30, 0.40)},
    "stop and go": ["belt.speed=0.15", "belt.motion=stop_and_go"],
    "two speeds": ["belt.speed=0.15", "belt.motion=two_speed"],
}
KINDS = {"box": PartKind.BOX, "disc": PartKind.DISC, "ell": PartKind.ELL}
PER_PART, PER_MEASUREMENT = ("bias_m", "turn_bias_rad"), ("noise_m", "turn_noise_rad")
COUNTS = ("parts", "measurements", "wrong_kind", "identities_lost")


def job(cell, seed, quick):
    """Returns the line of a run: the errors of vision for each kind of part."""
    rate = min(RATE, 10.0) if cell.startswith("0.05") else RATE  # more do not fit on the slowest belt
    scenario = load_scenario(
        "conveyor", seed=seed, duration=20.0 if quick else DURATION, overrides=[*CELLS[cell], f"arrivals.rate={rate}"]
    )
    with tempfile.TemporaryDirectory() as folder:
        simulate(scenario, out=f"{folder}/run", options=RunOptions(record=False))
        log, arrivals = load_log(Path(folder) / "run" / "log.npz"), resolve(scenario).arrivals
    return {"kinds": {name: vision_errors(log, arrivals, kind) for name, kind in KINDS.items()}}


def pooled(lines):
    """Returns the errors of several runs as those of one: sums of counts, and rms values over all parts or
    measurements."""
    lines = [line for line in lines if line["parts"]]
    found = {key: sum(line[key] for line in lines) for key in COUNTS}
    for keys, weight in ((PER_PART, "parts"), (PER_MEASUREMENT, "measurements")):
        for key in keys:
            pairs = [(line[key], line[weight]) for line in lines if line[key] is not None]
            total = sum(count for _, count in pairs)
            found[key] = float(np.sqrt(sum(v**2 * count for v, count in pairs) / total)) if total else None
    found["largest_m"] = max((line["largest_m"] for line in lines), default=None)
    return found


def summary(rows):
    """Returns the results of a cell."""
    return {"runs": len(rows), "kinds": {name: pooled([row["kinds"][name] for row in rows]) for name in KINDS}}


def vision_table(cells):
    """Returns (header, rows): a row for each motion of the belt and kind of part."""

    def number(value, scale, unit):
        return "" if value is None else f"{scale * value:.2f} {unit}"

    rows = [
        [
            cell["cell"],
            kind,
            errors["parts"],
            number(errors["bias_m"], 1e3, "mm"),
            number(errors["noise_m"], 1e3, "mm"),
            number(errors["largest_m"], 1e3, "mm"),
            number(errors["turn_bias_rad"], 57.29578, "deg"),
            number(errors["turn_noise_rad"], 57.29578, "deg"),
            f"{errors['wrong_kind']} of {errors['measurements']}",
            errors["identities_lost"],
        ]
        for cell in cells
        for kind, errors in cell["kinds"].items()
    ]
    header = ["belt", "kind", "parts", "bias, rms", "noise, rms", "largest error", "direction bias, rms"]
    return [*header, "direction noise, rms", "wrong kind, of measurements", "identities lost"], rows


TABLES = {"vision": vision_table}
PARTS = {"vision": Part(job, dict.fromkeys(CELLS, RUNS), 5500, summary, vision_table)}


if __name__ == "__main__":
    parts.main(__doc__, PARTS, FOLDER, RESULTS)
