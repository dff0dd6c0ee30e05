"""Whether the autopsy of a failed run names what was wrong: seven known faults, each sized to halve the success rate.

    python benchmarks/autopsy.py                        seven faults and no fault, 20 runs each; goes on where it was
    python benchmarks/autopsy.py --faults link,servo    some of them
    python benchmarks/autopsy.py --faults link --size 0.9 --first-seed 0 --seeds 6 --results /tmp/try.jsonl

A fault is a setting of the scenario where there is one, and else a part that this script puts in the place of the
scenario's. Sizes were found on seeds below 100, as was all that the autopsy knows of healthy runs (``--normal``
prints that); the table is of seeds 740 to 759. Each run lasts 25 s at most, time for one attempt or two. The faults
of vision and triangulation need images, the others run on measured vision.
"""

import argparse
import contextlib
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from common import append_results, print_table

from drake_tracker.arm import servo_system
from drake_tracker.arm.servo import Servo
from drake_tracker.campaign.record import read_lines
from drake_tracker.campaign.trial import Lost
from drake_tracker.campaign.wilson import wilson
from drake_tracker.core.errors import MachineError
from drake_tracker.core.log import load_log
from drake_tracker.report.autopsy.autopsy import perform
from drake_tracker.report.autopsy.stages import WORDS, Stage
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train import diagram as train
from drake_tracker.tasks.train.summary import tidy
from drake_tracker.vision.normal_flow import NormalFlow
from drake_tracker.vision.vision_diagram import VisionDiagram

FIRST_SEED, SEEDS, DURATION = 740, 20, 25.0
RESULTS = Path(__file__).parent / "results" / "autopsy.jsonl"
MEASURED = "vision=!Measured {}"
KEPT = ("success", "attempts", "time_to_grasp_s", "failure_reason", "simulated_s", "package_versions", "git_commit")


class ShiftedFlow(NormalFlow):
    """Normal flow whose centroid lies ``shift`` [px] too far to the right, as with something that moves beside."""

    shift = 0.0

    def centroid(self, mask):
        region = super().centroid(mask)
        return None if region is None else region._replace(u=region.u + self.shift)


def shifted_vision(shift):
    """A `VisionDiagram` whose left camera's centroids are off."""

    def make(cameras, windows, image_windows, flow, *rest, **settings):
        detectors = {
            side: (ShiftedFlow if side == "left" else NormalFlow)(flow, window=windows[side].mask(image_windows[side]))
            for side in cameras
        }
        detectors["left"].shift = shift
        return VisionDiagram(cameras, windows, image_windows, flow, *rest, detectors=detectors, **settings)

    return mock.patch.object(train, "VisionDiagram", make)


@contextlib.contextmanager
def turned_camera(angle):
    """The right camera's calibration, turned by ``angle`` [rad] about the vertical through the camera."""
    whole = train.load_cameras

    def load(scenario):
        cameras = whole(scenario)
        right = cameras["right"]
        cos, sin = np.cos(angle), np.sin(angle)
        X_WC = right.X_WC
        X_WC[:3, :3] = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ X_WC[:3, :3]
        return cameras | {"right": replace(right, X_CW=np.linalg.inv(X_WC))}

    with mock.patch.object(train, "load_cameras", load):
        yield


@dataclass(frozen=True)
class SmoothedState:
    """The state of an estimator, and of the low-pass before it."""

    inner: Any
    point: Any = None
    before: float = -np.inf

    @property
    def stamp(self):
        return self.inner.stamp

    def __deepcopy__(self, memo):
        return self


class Wrapped:
    """An estimator that passes everything on to another one."""

    def __init__(self, inner, size):
        self._inner, self._size = inner, size

    def __getattr__(self, name):
        return getattr(self._inner, name)


class Smoothed(Wrapped):
    """An estimator behind a low-pass with a time constant of ``size`` [s]: its present is the past."""

    def initial_state(self):
        return SmoothedState(self._inner.initial_state())

    def update(self, state, stamp, p_WQ):
        if p_WQ is not None and stamp > state.before:
            gap = stamp - state.before
            share = 1.0 if state.point is None or gap > 0.3 else 1.0 - np.exp(-gap / self._size)
            last = p_WQ if state.point is None else state.point
            p_WQ = last + share * (np.asarray(p_WQ) - last)
        inner = self._inner.update(state.inner, stamp, p_WQ)
        return state if inner is state.inner else SmoothedState(inner, p_WQ, stamp)

    def ready(self, state):
        return self._inner.ready(state.inner)

    def predict(self, state, times):
        return self._inner.predict(state.inner, times)

    def predict_std(self, state, times):
        return self._inner.predict_std(state.inner, times)


class Straightened(Wrapped):
    """An estimator whose prediction is, by a share of ``size``, one of constant velocity."""

    def predict(self, state, times):
        path = self._inner.predict(state, times)
        step = 0.02
        here, there = self._inner.predict(state, np.array([state.stamp, state.stamp + step]))
        straight = here + np.outer(np.asarray(times) - state.stamp, (there - here) / step)
        straight[:, 3] = here[3]
        return (1.0 - self._size) * path + self._size * straight


def wrapped_estimator(kind, size):
    whole = train.estimator_of
    return mock.patch.object(train, "estimator_of", lambda *settings: kind(whole(*settings), size))


def late_servo(lag):
    """A servo that reads each packet for an instant ``lag`` [s] before the one that its set-point is due."""

    class LateServo(Servo):
        def __init__(self, *settings, lead):
            super().__init__(*settings, lead=lead - lag)

    return mock.patch.object(servo_system, "Servo", LateServo)


@dataclass(frozen=True)
class Fault:
    """What is wrong. ``overrides(size)``: settings; ``part(size)``: a context in which a part is replaced."""

    stage: Stage | None
    size: float
    unit: str
    what: str
    overrides: Any = lambda size: [MEASURED]
    part: Any = lambda size: contextlib.nullcontext()


FAULTS = {
    "vision": Fault(Stage.VISION, 16.0, "px", "the left camera's centroids shifted", lambda size: [], shifted_vision),
    "triangulation": Fault(
        Stage.TRIANGULATION, 0.02, "rad", "the right camera's calibration turned", lambda size: [], turned_camera
    ),
    "filter": Fault(
        Stage.FILTER, 0.42, "s", "a low-pass before the estimator", part=lambda size: wrapped_estimator(Smoothed, size)
    ),
    "prediction": Fault(
        Stage.PREDICTION,
        0.62,
        "",
        "share of constant velocity in the prediction",
        part=lambda size: wrapped_estimator(Straightened, size),
    ),
    "link": Fault(
        Stage.LINK,
        0.77,
        "",
        "share of packets lost, 30 in a row on average",
        lambda size: [MEASURED, f"link=!Lossy {{drop: {size}, burst: 30}}"],
    ),
    "servo": Fault(Stage.SERVO, 0.39, "s", "set-points late", part=late_servo),
    "timing": Fault(Stage.TIMING, 0.24, "s", "closing_lead", lambda size: [MEASURED, f"grasp.closing_lead={size}"]),
    "none": Fault(None, 0.0, "", "no fault, measured vision"),
    "none-rendered": Fault(None, 0.0, "", "no fault, images", lambda size: []),
}


def run_one(job):
    """Runs one trial in a worker and its autopsy; returns its line, or `Lost`."""
    name, size, seed = job
    fault = FAULTS[name]
    start = time.monotonic()
    scenario = load_scenario("train", seed=seed, duration=DURATION, overrides=fault.overrides(size))
    with tempfile.TemporaryDirectory() as folder, fault.part(size):
        try:
            summary = simulate(scenario, out=folder, record=False)
        except (MachineError, MemoryError, OSError) as error:
            return Lost(f"{type(error).__name__}: {error}")
        found = perform(scenario, load_log(Path(folder) / "log.npz"))
    return {
        "fault": name,
        "size": size,
        "seed": seed,
        **{key: summary[key] for key in KEPT},
        "named": found["culprit"],
        "autopsy": tidy(found),
        "wall_s": round(time.monotonic() - start, 1),
    }


def outcome(row):
    """Returns in words what came of a run."""
    if row["success"]:
        return f"{row['fault']} {row['size']:g} seed {row['seed']}: lifted, attempt {row['attempts']}"
    return f"{row['fault']} {row['size']:g} seed {row['seed']}: failed after {row['attempts']}, named {row['named']}"


def print_results(rows):
    """Prints, for each fault, how often the train was lifted and how many failed runs were named right."""
    header = ("fault", "what is wrong", "size", "runs", "lifted", "failed", "named right", "Wilson 95 %")
    lines, all_right, all_failed = [], 0, 0
    for name in FAULTS:
        mine = [row for row in rows if row["fault"] == name]
        if not mine:
            continue
        fault, failed = FAULTS[name], [row for row in mine if not row["success"]]
        right = sum(fault.stage is not None and row["named"] == WORDS[fault.stage] for row in failed)
        if fault.stage is not None:
            all_right, all_failed = all_right + right, all_failed + len(failed)
        size = f"{mine[0]['size']:g} {fault.unit}".strip() if fault.stage is not None else ""
        lines.append((name, fault.what, size, len(mine), len(mine) - len(failed), len(failed), *_share(right, failed)))
    low, high = wilson(all_right, all_failed)
    share = f"{100 * low:.0f}-{100 * high:.0f} %"
    lines.append(("all faults", "", "", "", "", all_failed, all_right, share))
    print_table(header, lines)
    for row in rows:
        stage = FAULTS[row["fault"]].stage
        if not row["success"] and stage is not None and row["named"] != WORDS[stage]:
            print(f"named wrongly: {row['fault']} seed {row['seed']}: {row['named']}")


def print_normal(rows):
    """Prints the most that each stage contributed in these runs, in mm: at the attempt that lifted, and tracking."""
    lines = []
    for word in WORDS.values():
        attempt = max(row["autopsy"]["attempts"][-1]["size_m"][word] for row in rows)
        tracking = max(row["autopsy"]["tracking"]["size_m"][word] for row in rows)
        lines.append((word, f"{1e3 * attempt:.2f}", f"{1e3 * tracking:.2f}"))
    print_table(("stage", "attempt [mm]", f"tracking [mm], {len(rows)} runs"), lines)


def _share(right, failed):
    low, high = wilson(right, len(failed))
    return (right, f"{100 * low:.0f}-{100 * high:.0f} %") if failed else ("", "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", default="all", help="names separated by commas")
    parser.add_argument("--size", type=float, help="in place of the fault's own")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="runs a fault")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--normal", action="store_true", help="print the most that each stage contributed, all runs")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    names = list(FAULTS) if options.faults == "all" else options.faults.split(",")
    unknown = [name for name in names if name not in FAULTS]
    if unknown:
        parser.error(f"unknown fault {unknown[0]}; there are {', '.join(FAULTS)}")

    sizes = {name: FAULTS[name].size if options.size is None else options.size for name in names}
    done = {(row["fault"], row["size"], row["seed"]) for row in read_lines(options.results)}
    jobs = [
        (name, sizes[name], seed)
        for seed in range(options.first_seed, options.first_seed + options.seeds)
        for name in names
        if (name, sizes[name], seed) not in done
    ]
    append_results(run_one, jobs, options.results, options.workers, outcome)
    rows = [row for row in read_lines(options.results) if sizes.get(row["fault"]) == row["size"]]
    if options.normal:
        print_normal([row for row in rows if row["success"]])
    else:
        print_results(rows)


if __name__ == "__main__":
    main()
