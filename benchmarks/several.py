"""Measures the vision that tracks several objects (`vision.tracker: !Several {}`), part by part.

    python benchmarks/several.py                       all parts but the cost, on two processes; resumes
    python benchmarks/several.py --part separation     one part
    python benchmarks/several.py --part lift --cells two,visitor
    python benchmarks/several.py --part cost           times: run nothing else meanwhile
    python benchmarks/several.py --quick --part lift   a trial on seeds of its own; nothing is written to the results

- separation: two trains on one oval, .10 to .40 m apart along the track; the vision alone, on rendered images. The
  number before, that of `!Single`, is from the same images. All images of a lap count. At .10 and .12 m the trains have
  0.7 of their length, because longer ones would touch.
- passing: two trains on two tracks, one inside the other, in opposite directions, for 60 s: identities.
- coverage: how many of the total errors are within one reported standard deviation, along each axis and in all.
- lift: how often the train is lifted in the whole loop, with company and in bad light.
- cameras: the same with cameras at other elevations and azimuths, which are calibrated first.
- shake: a shaking and a panning camera: error of the centroid, unusable images, wrong centroids.
- cost: time of the vision in a cycle, and of the whole loop, beside that of `!Single`.

Each trial becomes a line of ``runs/several/PART.jsonl`` as soon as it ends, and is not repeated on the same commit. All
trials of this commit are the results of a part, which replace those of the same part in ``results/several.json``.
Seeds 2500 to 3099 and 3240 to 3319 are used nowhere else. Seeds 2800 to 2839 and 3200 to 3239 served development: one
of each showed a track that stayed wrong after a bad start.
"""

import argparse
import json
import math
import statistics
import sys
from collections import Counter
from pathlib import Path

import common
import numpy as np
import several_measures as measures
import several_tables
from common import append_results, print_table, provenance
from several_cost import cost_of_loop, cost_of_vision
from several_worlds import SEVERAL as ONLY_SEVERAL
from several_worlds import follow, lap_time, train_lengths, watch

from drake_tracker.campaign.record import read_lines
from drake_tracker.campaign.trial import run_line
from drake_tracker.campaign.wilson import wilson
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.results import git_commit
from drake_tracker.world.cameras import true_camera_models

RESULTS = common.RESULTS / "several.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "several"
QUICK_SEED = 3900
"""Trials are on seeds from here on, so that the published ones stay unseen."""
SEVERAL, IN_PROCESS = "vision.tracker=!Several {}", "cameras.render_processes=0"
START_UP = 1.0
"""Until this time [s] the trains accelerate."""
SEPARATIONS = (0.10, 0.12, 0.15, 0.18, 0.22, 0.25, 0.30, 0.40)
SHORT, SHORT_UP_TO = 0.7, 0.13
"""Scale of trains that are at most this far apart [m]; whole ones need .135 m."""
BODIES = ("plain", "striped", "round", "dark")
OPPOSITE = [
    "track.centre_range=0",
    "track.direction=forward",
    "objects=[!Train {body: striped, track: {kind: circle, radius: 0.09, centre_range: 0, direction: backward}}]",
]
"""A train on a circle inside the oval of the first one: their centre lines are .07 to .13 m apart where they pass."""
COVERAGE = {  # cell: scenario, overrides, with the loop
    "alone": ("train", [SEVERAL], False),
    "train 0.18 m behind": ("train", [SEVERAL, "objects=[!Train {body: striped, ahead: -0.18}]"], False),
    "train in the opposite direction": ("train", [SEVERAL, *OPPOSITE], False),
    "ball": ("train:visitor", [], False),
    "arm": ("train", [SEVERAL], True),
    "arm and train 0.25 m behind": ("train", [SEVERAL, "objects=[!Train {body: striped, ahead: -0.25}]"], True),
}
LIFT = {  # cell: scenario, overrides, number of seeds; of two trains the yellow one counts, whichever is seen first
    "two": ("train:two", ["vision.tracker.target=!Coloured {}"], 40),
    "visitor": ("train:visitor", [], 40),
    "alone": ("train", [SEVERAL], 68),
    "shadows": ("train", [SEVERAL, "lighting.shadows=true"], 20),
    "one-sided-shadows": ("train", [SEVERAL, "lighting.shadows=true", "lighting.side=one_side"], 20),
    "dark-on-bright": ("train", [SEVERAL, "train.body=dark", "table_colour='#d8d0c0'"], 20),
    "noise-12": ("train", [SEVERAL, "cameras.noise=12"], 20),
    "flicker-10%": ("train", [SEVERAL, "lighting.flicker=0.1"], 20),
    "low-contrast": ("train", [SEVERAL, "train.colour='#604838'"], 20),
}
CAMERAS = {  # cell: overrides
    **{f"elevation {angle}": [f"cameras.elevation_deg={angle}"] for angle in (15, 30, 45, 60)},
    **{
        f"azimuth {angle}": ["cameras.elevation_deg=30", f"cameras.azimuth_deg=[{angle}, -{angle}]"]
        for angle in (30, 45, 60, 75)
    },
}
SHAKE_FROM = 9.0
"""Time [s] at which a camera begins to move; the train has completed its first lap."""
SHAKE = {  # cell: faults
    "still": "[]",
    "shake 1 px": f"[!CameraShake {{std: 1, at: {SHAKE_FROM}}}]",
    "pan 0.5 px": f"[!CameraPan {{rate: 0.5, at: {SHAKE_FROM}, for: 2.0}}]",
}
SHAKE_SECONDS = 6.0


def separation_job(cell, seed, quick):
    """Returns the line of two trains at the separation ``cell`` [m]."""
    scale = SHORT if cell <= SHORT_UP_TO else 1.0
    scenario = load_scenario(
        "train",
        seed=seed,
        overrides=[
            IN_PROCESS,
            f"train.scale={scale}",
            f"objects=[!Train {{body: striped, scale: {scale}, ahead: -{cell}}}]",
        ],
    )
    lap, lengths = lap_time(scenario), train_lengths(scenario)
    laps = 1.3 if quick else 3.0
    found = {}
    for name, record in watch(scenario, START_UP + laps * lap).items():
        second = START_UP + lap
        found[name] = {
            "first_lap": measures.separation_numbers(record.between(START_UP, second), lengths, START_UP, lap),
            "later": measures.separation_numbers(record.between(second, START_UP + laps * lap), lengths, second, lap),
        }
        if name == "several":
            found[name]["time_until_both_s"] = measures.time_until_all(record)
            found[name] |= measures.identity_numbers(record)
    return found


def passing_job(cell, seed, quick):
    """Returns the line of two trains in opposite directions."""
    scenario = load_scenario("train", seed=seed, overrides=[IN_PROCESS, *OPPOSITE])
    record = watch(scenario, 10.0 if quick else 60.0, ONLY_SEVERAL)["several"]
    return {
        **measures.identity_numbers(record),
        "images": len(record.stamps),
        "both": int((measures.assigned(record, measures.NEAR) >= 0).all(axis=1).sum()),
        "time_until_both_s": measures.time_until_all(record),
    }


def coverage_job(cell, seed, quick):
    """Returns the line of one run of a cell of `COVERAGE`: its errors, as numbers."""
    name, overrides, with_arm = COVERAGE[cell]
    body = BODIES[seed % len(BODIES)]
    scenario = load_scenario(name, seed=seed, overrides=[IN_PROCESS, *overrides, f"train.body={body}"])
    if with_arm:
        record = follow(scenario, 14.0 if quick else 40.0)
    else:
        record = watch(scenario, 6.0 if quick else 20.0, ONLY_SEVERAL)["several"]
    trains = 1 + sum(type(each).__name__ == "Train" for each in scenario.objects)
    shares, errors, strays = measures.errors_in_std(record, trains)
    return {
        "body": body,
        "strays": strays,
        "shares": [[round(float(value), 3) for value in row] for row in shares],
        "errors_mm": [[round(1e3 * float(value), 2) for value in row] for row in errors],
    }


def lift_job(cell, seed, quick):
    """Returns the line of one run of a cell of `LIFT`, or `Lost`."""
    name, overrides, _ = LIFT[cell]
    return run_line(load_scenario(name, seed=seed, overrides=[IN_PROCESS, *overrides]))


def cameras_job(cell, seed, quick):
    """Returns the line of one run of a cell of `CAMERAS`, or `Lost`."""
    calibration = f"cameras.calibration={calibration_file(cell)}"
    return run_line(load_scenario("train", seed=seed, overrides=[IN_PROCESS, SEVERAL, *CAMERAS[cell], calibration]))


def calibration_file(cell):
    """Returns the calibration of the cameras of a cell."""
    return FOLDER / f"cameras_{cell.replace(' ', '_')}.yaml"


def shake_job(cell, seed, quick):
    """Returns the line of one watched run with a moving camera."""
    scenario = load_scenario("train", seed=seed, overrides=[IN_PROCESS, f"faults={SHAKE[cell]}"])
    cameras = list(true_camera_models(scenario.cameras).values())
    end = SHAKE_FROM + (2.0 if quick else SHAKE_SECONDS)
    return {
        name: measures.centroid_numbers(record.between(SHAKE_FROM, end), cameras)
        for name, record in watch(scenario, end).items()
    }


PARTS = {  # name: function, cells with their numbers of seeds, first seed
    "separation": (separation_job, dict.fromkeys(SEPARATIONS, 3), 2500),
    "passing": (passing_job, {"opposite": 20}, 2600),
    "coverage": (coverage_job, dict.fromkeys(COVERAGE, 8), 2700),
    "lift": (lift_job, {cell: count for cell, (_, _, count) in LIFT.items()}, 3240),
    "cameras": (cameras_job, dict.fromkeys(CAMERAS, 10), 2900),
    "shake": (shake_job, dict.fromkeys(SHAKE, 5), 3000),
}
COST_SEED = 3100


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    part, cell, seed, quick, commit = job
    made = PARTS[part][0](cell, seed, quick)
    return {"cell": cell, "seed": seed, "commit": commit, **made} if isinstance(made, dict) else made


def describe(row):
    """Returns the progress line of a trial."""
    if "success" in row:
        end = "lifted" if row["success"] else f"not lifted: {row.get('failure_reason')}"
    else:
        end = "done"
    return f"{row['cell']} seed {row['seed']}: {end}"


def measure(part, chosen, seeds, quick, workers, commit):
    """Runs the trials of a part that are missing; returns all its lines of this commit, in the order of the cells."""
    _, counts, first = PARTS[part]
    if quick:
        first = QUICK_SEED
    cells = {
        cell: count if seeds is None else seeds for cell, count in counts.items() if not chosen or str(cell) in chosen
    }
    path = FOLDER / f"{'quick_' if quick else ''}{part}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    wanted = [(cell, seed) for cell, count in cells.items() for seed in range(first, first + count)]

    def lines():
        rows = read_lines(path) if path.exists() else []
        known = {(row["cell"], row["seed"]): row for row in rows if row.get("commit") == commit}
        places = {cell: place for place, cell in enumerate(counts)}
        return [known[key] for key in sorted(known, key=lambda key: (places[key[0]], key[1]))]

    done = {(row["cell"], row["seed"]) for row in lines()}
    if part == "cameras":
        calibrated = calibrate_cameras(cells)
        wanted = [(cell, seed) for cell, seed in wanted if cell in calibrated]
    jobs = [(part, cell, seed, quick, commit) for cell, seed in wanted if (cell, seed) not in done]
    append_results(run_one, jobs, path, workers, describe)
    return lines()


def calibrate_cameras(cells):
    """Calibrates the cameras of the cells that have no calibration yet; returns the cells with a calibration."""
    from drake_tracker.calibration.rendered_boards import calibrate

    for cell in cells:
        if not calibration_file(cell).exists():
            print(f"calibrating {cell}", file=sys.stderr, flush=True)
            try:
                calibrate(load_scenario("train", overrides=CAMERAS[cell]), calibration_file(cell))
            except DrakeTrackerError as error:
                print(f"{cell} cannot be calibrated: {error}", file=sys.stderr, flush=True)
    return [cell for cell in cells if calibration_file(cell).exists()]


def summed(rows):
    """Returns the sums of the values of several dicts of numbers."""
    return {key: sum(row[key] for row in rows) for key in rows[0]}


def of_cells(rows, summary):
    """Returns a list of the results of all cells, in their order: ``summary`` of the lines of each."""
    cells = dict.fromkeys(row["cell"] for row in rows)
    return [{"cell": cell, **summary([row for row in rows if row["cell"] == cell])} for cell in cells]


def separation_summary(rows):
    """Returns the results of one separation."""
    times = [row["several"]["time_until_both_s"] for row in rows]
    return {
        "runs": len(rows),
        "scale": SHORT if rows[0]["cell"] <= SHORT_UP_TO else 1.0,
        "time_until_both_s": times,
        **{key: sum(row["several"][key] for row in rows) for key in ("swaps", "begun_again", "lost")},
        **{
            f"{name}_{part}": summed([row[name][part] for row in rows])
            for name in ("several", "single")
            for part in ("first_lap", "later")
        },
    }


def passing_summary(rows):
    """Returns the results of the trains in opposite directions."""
    counted = ("swaps", "begun_again", "lost")
    return {
        "runs": len(rows),
        "clean_runs": sum(not any(row[key] for key in counted) for row in rows),
        **summed([{key: row[key] for key in (*counted, "images", "both")} for row in rows]),
    }


def coverage_summary(rows):
    """Returns the results of a cell of `COVERAGE`."""
    errors = [[error[axis] for row in rows for error in row["errors_mm"]] for axis in range(3)]
    return {
        "runs": len(rows),
        "bodies": sorted({row["body"] for row in rows}),
        "points": sum(len(row["shares"]) for row in rows),
        "strays": sum(row["strays"] for row in rows),
        "rms_mm": [common.rms(values) for values in errors],
        "mean_mm": [statistics.fmean(values) if values else math.nan for values in errors],
        "coverage": measures.coverage_numbers([np.reshape(row["shares"], (-1, 3)) for row in rows]),
    }


def lift_summary(rows):
    """Returns the results of a cell of `LIFT` or `CAMERAS`."""
    lifted = sum(bool(row["success"]) for row in rows)
    first = sum(bool(row.get("first_attempt_success")) for row in rows)
    return {
        "runs": len(rows),
        "first_attempt": first,
        "first_attempt_wilson": wilson(first, len(rows)),
        "lifted": lifted,
        "lifted_wilson": wilson(lifted, len(rows)),
        "times_to_grasp_s": [row["time_to_grasp_s"] for row in rows if row.get("time_to_grasp_s") is not None],
        "reasons": dict(Counter(row.get("failure_reason") for row in rows if not row["success"]).most_common()),
        "limits_exceeded": [row["seed"] for row in rows if not limits_kept(row)],
    }


def limits_kept(row):
    """Returns whether a run exceeded no limit of the arm."""
    return (
        row.get("speed_share") is not None
        and row["speed_share"] <= 1.0
        and row["longest_saturation_s"] <= 0.030 + 1e-6
        and row["joint_limit_margin_rad"] >= 0.0
        and not (row.get("table_touched") or row.get("self_touched"))
    )


def shake_summary(rows):
    """Returns the results of a cell of `SHAKE`: medians and means over the runs."""

    def mean(values):
        return sum(values) / len(values) if values else None

    return {
        "runs": len(rows),
        **{
            name: {
                key: mean([row[name][key] for row in rows if row[name][key] is not None])
                for key in ("unusable", "invalid", "median_px", "wrong")
            }
            for name in ("several", "single")
        },
    }


SUMMARIES = {
    "separation": separation_summary,
    "passing": passing_summary,
    "coverage": coverage_summary,
    "lift": lift_summary,
    "cameras": lift_summary,
    "shake": shake_summary,
}


def merge(path, result):
    """Replaces the results of a part in the JSON file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    parts = {each["part"]: each for each in [*before, result]}
    order = [*SUMMARIES, "cost"]
    kept = [parts[name] for name in order if name in parts]
    path.write_text(json.dumps(kept, indent=2) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=[*PARTS, "cost"], help="default: all but the cost")
    parser.add_argument("--cells", help="cells of the part, separated by commas")
    parser.add_argument("--seeds", type=int, help="runs per cell")
    parser.add_argument("--workers", type=int, default=2, choices=(1, 2), help="processes (default 2)")
    parser.add_argument("--quick", action="store_true", help="short runs on other seeds, printed only")
    parser.add_argument("--json", type=Path, default=RESULTS, metavar="FILE", help="results (default %(default)s)")
    options = parser.parse_args()
    chosen = options.cells.split(",") if options.cells else []
    known = PARTS[options.part][1] if options.part in PARTS else {}
    unknown = [cell for cell in chosen if cell not in map(str, known)]
    if unknown:
        parser.error(f"unknown cell {unknown[0]}; there are {', '.join(map(str, known))}")
    commit = git_commit()
    for part in [options.part] if options.part else PARTS:
        if part == "cost":
            seeds = [QUICK_SEED if options.quick else COST_SEED]
            cells = [
                cost_of_vision("train", "vision of one train, one cycle", seeds[0], options.quick),
                cost_of_vision("train:two", "vision of two trains, one cycle", seeds[0], options.quick),
                cost_of_loop(seeds[0], options.quick),
            ]
        else:
            rows = measure(part, chosen, options.seeds, options.quick, options.workers, commit)
            seeds = sorted({row["seed"] for row in rows})
            cells = of_cells(rows, SUMMARIES[part])
        result = {"part": part, "made_by": {**provenance(seeds), "commit": commit}, "cells": cells}
        print_table(*several_tables.TABLES[part](cells))
        if not options.quick:
            merge(options.json, result)


if __name__ == "__main__":
    main()
