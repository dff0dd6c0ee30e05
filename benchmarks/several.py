"""Measures the vision that tracks several objects (`vision.method: !SilhouetteTracker {}`), part by part.

    python benchmarks/several.py                       all parts but the cost, on two processes; resumes
    python benchmarks/several.py --part separation     one part
    python benchmarks/several.py --part lift --cells two,visitor
    python benchmarks/several.py --part cost           times: run nothing else meanwhile
    python benchmarks/several.py --quick --part lift   a trial on seeds of its own; nothing is written to the results

- separation: two trains on one oval, .10 to .40 m apart along the track; the vision alone, on rendered images. The
  number before, that of `!MotionCentroid`, is from the same images. All images of a lap count. At .10 and .12 m the
  trains have 0.7 of their length, because longer ones would touch.
- passing: two trains on two tracks, one inside the other, in opposite directions, for 60 s: identities.
- coverage: how many of the total errors are within one reported standard deviation, along each axis and in all.
- lift: how often the train is lifted in the whole loop, with company and in bad light.
- cameras: the same with cameras at other elevations and azimuths, which are calibrated first.
- shake: a shaking and a panning camera: error of the centroid, unusable images, wrong centroids.
- cost: time of the vision in a cycle, and of the whole loop, beside that of `!MotionCentroid`.

Each trial becomes a line of ``runs/several/PART.jsonl`` as soon as it ends, and is not repeated on the same commit. All
trials of this commit are the results of a part, which replace those of the same part in ``results/several.json``.
Seeds 2500 to 3099 and 3240 to 3319 are used nowhere else. Seeds 2800 to 2839 and 3200 to 3239 served development: one
of each showed a track that stayed wrong after a bad start.
"""

import math
import statistics
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from methods import several_measures as measures
from methods.several_cost import cost_of_loop, cost_of_vision
from methods.several_worlds import SEVERAL as ONLY_SEVERAL
from methods.several_worlds import follow, lap_time, train_lengths, watch
from result_tables.several_tables import TABLES
from shared import common, parts
from shared.parts import Part, Timed, summed

from drake_tracker.campaign.plan import run_line
from drake_tracker.campaign.rates import wilson
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks import load_scenario
from drake_tracker.world.imaging.cameras import true_camera_models

RESULTS = common.RESULTS / "several.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "several"
IN_PROCESS = "cameras.render_processes=0"
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
    "alone": ("train:guided", [], False),
    "train 0.18 m behind": ("train:guided", ["objects=[!Train {body: striped, ahead: -0.18}]"], False),
    "train in the opposite direction": ("train:guided", [*OPPOSITE], False),
    "ball": ("train:visitor", [], False),
    "arm": ("train:guided", [], True),
    "arm and train 0.25 m behind": ("train:guided", ["objects=[!Train {body: striped, ahead: -0.25}]"], True),
}
LIFT = {  # cell: scenario, overrides, number of seeds; of two trains the yellow one counts, whichever is seen first
    "two": ("train:two", ["vision.method.target=!Coloured {}"], 40),
    "visitor": ("train:visitor", [], 40),
    "alone": ("train:guided", [], 68),
    "shadows": ("train:guided", ["lighting.shadows=true"], 20),
    "one-sided-shadows": ("train:guided", ["lighting.shadows=true", "lighting.side=one_side"], 20),
    "dark-on-bright": ("train:guided", ["train.body=dark", "table_colour='#d8d0c0'"], 20),
    "noise-12": ("train:guided", ["cameras.noise=12"], 20),
    "flicker-10%": ("train:guided", ["lighting.flicker=0.1"], 20),
    "low-contrast": ("train:guided", ["train.colour='#604838'"], 20),
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
        "train:guided",
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
    scenario = load_scenario("train:guided", seed=seed, overrides=[IN_PROCESS, *OPPOSITE])
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
    return run_line(load_scenario("train:guided", seed=seed, overrides=[IN_PROCESS, *CAMERAS[cell], calibration]))


def calibration_file(cell):
    """Returns the calibration of the cameras of a cell."""
    return FOLDER / f"cameras_{cell.replace(' ', '_')}.yaml"


def shake_job(cell, seed, quick):
    """Returns the line of one watched run with a moving camera."""
    scenario = load_scenario("train:guided", seed=seed, overrides=[IN_PROCESS, f"faults={SHAKE[cell]}"])
    cameras = list(true_camera_models(scenario.cameras).values())
    end = SHAKE_FROM + (2.0 if quick else SHAKE_SECONDS)
    return {
        name: measures.centroid_numbers(record.between(SHAKE_FROM, end), cameras)
        for name, record in watch(scenario, end).items()
    }


def calibrate_cameras(cells):
    """Calibrates the cameras of the cells that have no calibration yet; returns the cells with a calibration."""
    from drake_tracker.calibration.rendered_boards import calibrate

    for cell in cells:
        if not calibration_file(cell).exists():
            print(f"calibrating {cell}", file=sys.stderr, flush=True)
            try:
                calibrate(load_scenario("train:guided", overrides=CAMERAS[cell]), calibration_file(cell))
            except DrakeTrackerError as error:
                print(f"{cell} cannot be calibrated: {error}", file=sys.stderr, flush=True)
    return [cell for cell in cells if calibration_file(cell).exists()]


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


def cost(seed, quick):
    """Returns the results of the cost."""
    return [
        cost_of_vision("train:guided", "vision of one train, one cycle", seed, quick),
        cost_of_vision("train:two", "vision of two trains, one cycle", seed, quick),
        cost_of_loop(seed, quick),
    ]


LIFT_SEEDS = {cell: count for cell, (_, _, count) in LIFT.items()}
PARTS = {
    "separation": Part(separation_job, dict.fromkeys(SEPARATIONS, 3), 2500, separation_summary, TABLES["separation"]),
    "passing": Part(passing_job, {"opposite": 20}, 2600, passing_summary, TABLES["passing"]),
    "coverage": Part(coverage_job, dict.fromkeys(COVERAGE, 8), 2700, coverage_summary, TABLES["coverage"]),
    "lift": Part(lift_job, LIFT_SEEDS, 3240, lift_summary, TABLES["lift"]),
    "cameras": Part(cameras_job, dict.fromkeys(CAMERAS, 10), 2900, lift_summary, TABLES["cameras"], calibrate_cameras),
    "shake": Part(shake_job, dict.fromkeys(SHAKE, 5), 3000, shake_summary, TABLES["shake"]),
    "cost": Timed(cost, 3100, TABLES["cost"]),
}


if __name__ == "__main__":
    parts.main(__doc__, PARTS, FOLDER, RESULTS)
