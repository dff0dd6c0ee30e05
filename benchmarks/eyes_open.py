"""Measures what vision until contact is good for (`grasp.descent: guided`), part by part.

    python benchmarks/eyes_open.py                 all parts, on two processes; resumes
    python benchmarks/eyes_open.py --part event    one part
    python benchmarks/eyes_open.py --quick         a trial on seeds of its own; nothing is written to the results

- event: the train on an oval at 0.20 m/s changes its speed around the launch. The offset along the path is that of the
  train's middle from the middle of the jaws, when they touch it. Events before the launch need a run without the event,
  which tells when the launch will be.
- calm: nothing happens. How many are lifted, and after how many laps: by the blind descent of 1991, by a guided one,
  and by `train`, which does not wait for a lap. Seeds 4120 to 4131 had shown that oblique jaws were opened too
  early; since that was cured, other seeds are measured. Of these, seed 4143 was looked at when the next cause was
  sought.
- pass: the train passes once, on an open track of at most 2 m, and stops at its end. `train` grasps it on the
  way when success is likely enough, and otherwise where it stands.
- hand: the calibration of a camera is wrong by 1 deg and 10 mm, with and without markers on the hand. Which camera, and
  in which direction, is drawn by the seed.
- wrist: a camera on the hand (`train:wrist`), also while a camera is dark during the descent.

The images are rendered. Seeds 4000 to 4749 are used nowhere else.
"""

import math
import tempfile
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
from methods.eyes_open_measures import place_errors, relative_errors
from methods.several_worlds import lap_time
from pydrake.systems.analysis import Simulator
from result_tables.eyes_open_tables import TABLES
from shared import common, parts
from shared.parts import Part

from drake_tracker import make_diagram, simulate
from drake_tracker.campaign.rates import wilson
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import ArmCommand, Frozen
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.closing import offset_at_touch
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.setup import resolve

RESULTS = common.RESULTS / "eyes_open.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "eyes_open"
COMMON = ["vision.method=!SilhouetteTracker {}", "cameras.render_processes=0"]
SAME_LIFT = "grasp.lift_height=0.18"
"""Both descents lift as high as `train` does: high enough for a train that hangs from its end."""
DESCENTS = ("blind", "guided")
EVENTS = {
    "half the speed": "!ChangeSpeed {factor: 0.5, %s}",
    "one and a half times the speed": "!ChangeSpeed {factor: 1.5, %s}",
    "stop": "!Stop {%s}",
    "reverse": "!Reverse {%s}",
}
WHEN = (-0.2, 0.0, 0.2)
"""Times of the events relative to the launch [s]."""
SHORT_LAG = 6
"""A shorter lag of vision than that of 1991, which is 15 [vision cycles]."""
SHORT_LAG_SETTING = f"vision.lag_cycles={SHORT_LAG}"
EVENT = {
    f"{name} {when:+.1f} s {descent}": (name, when, descent, [])
    for name in EVENTS
    for when in WHEN
    for descent in DESCENTS
}
EVENT[f"stop -0.2 s guided, lag of {SHORT_LAG} cycles"] = ("stop", -0.2, "guided", [SHORT_LAG_SETTING])
CALM = {
    f"{track} {way}": (track, way)
    for track in ("oval", "circle", "stadium")
    for way in ("blind", "guided", "train:guided")
}
VISIBLE = "vision.work_volume=[[0.33, -0.42, 0.45], [0.79, 0.42, 0.505]]"
"""A work volume that is as long as both cameras see: a fast train on a line leaves the default one too soon."""
QUICK = ("grasp.approach_duration=0.6", "grasp.settle_time=0")
"""A hand that does not wait above the train, because a fast one is gone by then."""
OPEN_TRACKS = {
    "line": (["track.kind=line", VISIBLE, *QUICK], (0.1, 0.2, 0.3, 0.5)),
    "sinusoid": (["track.kind=sinusoid"], (0.1, 0.15)),
    "polynomial": (["track.kind=polynomial"], (0.1, 0.15)),
    "random walk": (
        ["track.kind=random_walk", "track.length=2.0", "track.corner_radius=0.01", "track.straight_range=[0.05, 0.25]"],
        (0.05, 0.1),
    ),
}
"""Open tracks: {name: (settings, speeds [m/s])}."""
PASS = {f"{name} {speed} m/s": (name, speed, []) for name, (_, speeds) in OPEN_TRACKS.items() for speed in speeds}
PASS |= {
    f"random walk {speed} m/s, lag of {SHORT_LAG} cycles": ("random walk", speed, [SHORT_LAG_SETTING])
    for speed in OPEN_TRACKS["random walk"][1]
}
HAND = {"without markers": [], "with markers": ["arm.markers=true"]}
WRONG = "[!CalibrationWrong {camera: %s, angle_deg: %g, distance: %g}]"
WRONG_ANGLE, WRONG_DISTANCE = 1.0, 0.01
"""Errors of the calibration [deg, m] in part ``hand``. They have opposite signs, so that they displace the image to the
same side."""
HAND_HEIGHT, WRIST_HEIGHT = 0.17, 0.2
"""Heights of the tool above the middle of the train from which on errors are measured, until contact [m]."""
WRIST = {
    "train:wrist": ("train:wrist", None),
    "train:wrist with the camera on the hand dark": ("train:wrist", "wrist"),
    "train:wrist with the left camera dark": ("train:wrist", "left"),
    "train:guided": ("train:guided", None),
}
"""{cell of part ``wrist``: (scenario, camera that is dark during the descent)}."""
DARK = 2.0
"""Time from the launch for which a camera is dark [s]."""
STANDING = 0.02
"""Speed [m/s] up to which a train counts as standing when the hand descends."""
AFTER = 16.0
"""A run with an event ends this long after the launch [s]: long enough for a second attempt, by either descent."""


def launch_time(scenario):
    """Returns the time at which the hand begins to descend for the first time [s], None if it does not."""
    diagram = make_diagram(scenario)
    simulator = Simulator(diagram)
    for k in range(1, round(scenario.duration / SERVO_PERIOD)):
        simulator.AdvanceTo(k * SERVO_PERIOD)
        if ArmCommand(diagram.GetOutputPort("command").Eval(simulator.get_context())).frozen != Frozen.FREE:
            return k * SERVO_PERIOD
    return None


@cache
def launch_without_event(seed, settings):
    """Returns `launch_time` of ``train:learned`` without an event, which is the same for all events of a seed."""
    return launch_time(load_scenario("train:learned", seed=seed, overrides=list(settings)))


def line(scenario, measures=None):
    """Runs a scenario; returns what its summary and its log say about the grasp, ``p_success`` at the first launch
    included.

    Args:
        scenario: the scenario.
        measures: function of (log, phases) that returns further fields as a dict.
    """
    with tempfile.TemporaryDirectory() as folder:
        summary = simulate(scenario, out=f"{folder}/run", options=RunOptions(record=False))
        log = load_log(f"{folder}/run/log.npz")
        spans = phase_spans(log, scenario.time_step)
        offset = offset_at_touch(resolve(scenario), log, spans)
    wanted = ("success", "first_attempt_success", "attempts", "aborted_attempts", "time_to_grasp_s", "failure_reason")
    diagnosis = log["diagnosis"]
    launched = diagnosis["attempts"] > 0
    return {
        **{key: summary[key] for key in (*wanted, "cause")},
        "p_success": float(diagnosis["p_success"][launched.argmax()]) if launched.any() else None,
        "along_m": None if offset is None else offset[0],
        "across_m": None if offset is None else offset[1],
        "launch_speed": speed_at_launch(log, spans),
        "table_touched": summary["table_touched"],
        **(measures(log, spans) if measures else {}),
    }


def speed_at_launch(log, spans):
    """Returns the speed of the train at the beginning of the last descent [m/s], None without one."""
    starts = [span.start for span in spans if span.phase == Phase.INTERCEPT]
    if not starts:
        return None
    train = log["truth_train_state"]
    k = max(int(np.searchsorted(train.times, starts[-1], side="right")) - 1, 0)
    return float(np.hypot(train["vx"][k], train["vy"][k]))


def event_job(cell, seed, quick):
    """Returns the line of a run with an event around the launch."""
    name, when, descent, others = EVENT[cell]
    settings = [*COMMON, "track.speed=0.2", f"grasp.descent={descent}", SAME_LIFT, *others]
    launch = launch_without_event(seed, tuple(settings))
    if launch is None:
        return {"success": False, "failure_reason": "no launch", "along_m": None}
    time = f"after_launch: {when}" if when >= 0.0 else f"at: {launch + when}"
    settings += [f"track.event={EVENTS[name] % time}", f"duration={launch + AFTER}"]
    return {"launch_s": launch, **line(load_scenario("train:learned", seed=seed, overrides=settings))}


def calm_job(cell, seed, quick):
    """Returns the line of a run without an event."""
    track, way = CALM[cell]
    name, settings = ("train:guided", []) if way == "train:guided" else ("train:learned", [f"grasp.descent={way}"])
    scenario = load_scenario(name, seed=seed, overrides=[*COMMON, f"track.kind={track}", *settings])
    return {"lap_s": lap_time(scenario), **line(scenario)}


def pass_job(cell, seed, quick):
    """Returns the line of a run on an open track, which may be refused: a fast train is within reach for too short."""
    name, speed, others = PASS[cell]
    settings, _ = OPEN_TRACKS[name]
    overrides = [*COMMON, *settings, *others, f"track.speed={speed}", "track.start=0"]
    try:
        return line(load_scenario("train:guided", seed=seed, overrides=overrides))
    except DrakeTrackerError as error:
        return {"success": False, "failure_reason": str(error), "cause": "refused", "along_m": None}


def hand_job(cell, seed, quick):
    """Returns the line of a run with a wrong calibration that is drawn by the seed."""
    random = np.random.default_rng(seed)
    camera, sign = ("left", "right")[random.integers(2)], (-1.0, 1.0)[random.integers(2)]
    faults = f"faults={WRONG % (camera, sign * WRONG_ANGLE, -sign * WRONG_DISTANCE)}"
    scenario = load_scenario("train:guided", seed=seed, overrides=[*COMMON, *HAND[cell], faults])
    return line(scenario, lambda log, spans: {"relative_m": relative_errors(log, spans, HAND_HEIGHT)})


def wrist_job(cell, seed, quick):
    """Returns the line of a run in which a camera may be dark during the descent."""
    name, camera = WRIST[cell]
    scenario = load_scenario(name, seed=seed, overrides=COMMON)
    if camera is not None:
        launch = launch_time(scenario)
        if launch is None:
            return {"success": False, "failure_reason": "no launch", "along_m": None}
        faults = f"faults=[!CameraDark {{camera: {camera}, at: {launch}, for: {DARK}}}]"
        scenario = load_scenario(name, seed=seed, overrides=[*COMMON, faults])

    def measures(log, spans):
        errors, cycles = place_errors(log, spans, WRIST_HEIGHT)
        return {"errors_m": errors, "cycles": cycles}

    return line(scenario, measures)


def summary(rows):
    """Returns the results of a cell."""
    first = sum(bool(row.get("first_attempt_success")) for row in rows)
    return {
        "runs": len(rows),
        "first_attempt": first,
        "first_attempt_wilson": wilson(first, len(rows)),
        "lifted": sum(bool(row["success"]) for row in rows),
        "lifted_moving": sum(bool(row["success"]) and (row.get("launch_speed") or 0.0) > STANDING for row in rows),
        "aborted": sum(row.get("aborted_attempts", 0) for row in rows),
        "along_m": [abs(row["along_m"]) for row in rows if row["along_m"] is not None],
        "times_to_grasp_s": [row["time_to_grasp_s"] for row in rows if row.get("time_to_grasp_s") is not None],
        "laps": [
            row["time_to_grasp_s"] / row["lap_s"]
            for row in rows
            if row.get("time_to_grasp_s") is not None and math.isfinite(row.get("lap_s", math.nan))
        ],
        "table_touched": sum(bool(row.get("table_touched")) for row in rows),
        "causes": dict(Counter(str(row.get("cause")) for row in rows if not row["success"]).most_common()),
        "reasons": dict(Counter(row["failure_reason"] for row in rows if not row["success"]).most_common()),
    }


def median_and_p95(values):
    """Returns the median and the 95th percentile of the sizes of values as a list, None without values."""
    return np.percentile(np.abs(values), [50, 95]).tolist() if len(values) else None


def hand_summary(rows):
    """Returns the results of a cell with the errors of the vector from hand to train in all runs."""
    errors = [error for row in rows for error in row.get("relative_m", [])]
    return {**summary(rows), "relative_m": median_and_p95(errors), "measured": len(errors)}


def wrist_summary(rows):
    """Returns the results of a cell with the errors of the train's position in all runs."""
    errors = np.array([error for row in rows for error in row.get("errors_m", [])]).reshape(-1, 2)
    return {
        **summary(rows),
        "errors_along_m": median_and_p95(errors[:, 0]),
        "errors_across_m": median_and_p95(errors[:, 1]),
        "measured": len(errors),
        "cycles": sum(row.get("cycles", 0) for row in rows),
    }


PARTS = {
    "event": Part(event_job, dict.fromkeys(EVENT, 20), 4000, summary, TABLES["event"]),
    "calm": Part(calm_job, dict.fromkeys(CALM, 20), 4132, summary, TABLES["calm"]),
    "pass": Part(pass_job, dict.fromkeys(PASS, 30), 4200, summary, TABLES["pass"]),
    "hand": Part(hand_job, dict.fromkeys(HAND, 20), 4300, hand_summary, TABLES["hand"]),
    "wrist": Part(wrist_job, dict.fromkeys(WRIST, 20), 4400, wrist_summary, TABLES["wrist"]),
}

if __name__ == "__main__":
    parts.main(__doc__, PARTS, FOLDER, RESULTS)
