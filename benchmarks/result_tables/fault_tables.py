"""The faults that `faults.py` injects, the causes that are right for each, and the tables of its results."""

import random
import re
from dataclasses import dataclass

from shared.common import interval

BOTH = ("measured", "rendered")
DURATION = 40.0
"""Longest duration of a run [s]."""
RUNGS = ("train:learned", "train", "train:guided")
"""Scenarios into which faults are injected; a row without a scenario is of the first."""
SHOWN = 3.0
"""Time [s] that a fault needs to show."""
EARLY, EARLIER = "train:guided", 4.0
"""Scenario that grasps before 6 s, and by how much its faults begin earlier, but not before 1.5 s [s]."""
PAIRS, PAIR_SEED = 30, 929
"""Pairs of faults, and the seed that draws them."""
SAFE_PHASES = ("ACQUIRE", "TRACK", "RETREAT", "HOVER")
"""Phases in which the hand is above the train, or on its way up."""
MOST_SATURATION, MOST_SPEED = 0.030, 1.0
"""Largest time for which a drive may saturate [s], and largest fraction of a rated speed."""


@dataclass(frozen=True)
class Injected:
    """A fault of stated size.

    Attributes:
        what: in words.
        tag: YAML tag with its settings.
        causes: values of `drake_tracker.tasks.train.diagnosis.trouble.Cause` that are right for it.
        visions: with which vision it is run.
    """

    what: str
    tag: str
    causes: tuple[str, ...]
    visions: tuple[str, ...] = ("measured",)


FAULTS = {
    "camera-dark": Injected("left camera dark for 4 s", "!CameraDark {camera: left, at: 6, for: 4}", ("camera",), BOTH),
    "cameras-dark": Injected("both cameras dark", "!CameraDark {at: 6}", ("camera",), BOTH),
    "frozen-image": Injected(
        "right camera's image frozen", "!FrozenImage {camera: right, at: 6}", ("camera", "image_disturbed"), BOTH
    ),
    "flicker": Injected(
        "flicker of 60 % at 97 Hz",
        "!Flicker {amplitude: 0.6, frequency: 97, at: 6}",
        ("camera", "image_disturbed"),
        BOTH,
    ),
    "noise": Injected("noise of 40 grey levels", "!ImageNoise {std: 40, at: 6}", ("camera", "image_disturbed"), BOTH),
    "shadow": Injected(
        "a soft shadow of 50 % crosses the table every 4 s",
        "!CastShadow {darkness: 0.5, at: 4}",
        ("image_disturbed", "second_object"),
        BOTH,
    ),
    "occluder": Injected(
        "a panel before the left camera for 6 s",
        "!PassingOccluder {camera: left, at: 6, for: 6}",
        ("camera", "image_disturbed", "second_object"),
        BOTH,
    ),
    "second-mover": Injected(
        "a second object moves at 0.15 m/s", "!SecondMover {at: 6}", ("second_object", "image_disturbed"), BOTH
    ),
    "knocked": Injected(
        "right camera turned by 1.5 deg",
        "!CameraKnocked {camera: right, angle_deg: 1.5, at: 6}",
        ("calibration", "image_disturbed", "camera"),
        BOTH,
    ),
    "shake": Injected(
        "both cameras shake by 1 px",
        "!CameraShake {std: 1.0, at: 6}",
        ("image_disturbed", "camera", "calibration"),
        BOTH,
    ),
    "pan": Injected(
        "right camera turned by 0.5 px per image for 0.5 s",
        "!CameraPan {camera: right, rate: 0.5, at: 6, for: 0.5}",
        ("calibration", "image_disturbed", "camera"),
        BOTH,
    ),
    "calibration": Injected(
        "right camera's calibration wrong by 1.5 deg and 20 mm",
        "!CalibrationWrong {camera: right, angle_deg: 1.5, distance: -0.02}",
        ("calibration", "camera"),
        BOTH,
    ),
    "link-loss": Injected("all packets lost", "!LinkLoss {at: 6}", ("link",)),
    "link-bursts": Injected(
        "80 % of the packets lost, 120 in a row", "!LinkBursts {drop: 0.8, burst: 120, at: 4}", ("link",)
    ),
    "link-jitter": Injected("packets late by up to 1 s", "!LinkJitter {jitter: 1.0, at: 4}", ("link",)),
    "link-delay": Injected("packets 5 s late", "!LinkDelay {delay: 5.0}", ("link",)),
    "host-stopped": Injected("host stopped for 5 s", "!HostStopped {at: 6, for: 5}", ("host", "link")),
    "host-gone": Injected("host stopped for good", "!HostStopped {at: 6}", ("host", "link")),
    "train-stopped": Injected("train stops", "!TrainStopped {at: 6}", ("train_stopped",)),
    "train-reversed": Injected("train turns back", "!TrainReversed {at: 6}", ("train_reversed",)),
    "train-pushed": Injected(
        "a push of 2 N for 0.2 s along the train",
        "!TrainPushed {force: 2.0, at: 6}",
        ("train_displaced", "derailed", "train_stopped"),
    ),
    "train-derailed": Injected("train thrown off its track", "!TrainDerailed {at: 6}", ("derailed", "train_displaced")),
    "train-moved": Injected(
        "train carried to the middle of the table", "!TrainMoved {at: 6}", ("train_displaced", "derailed")
    ),
    "train-removed": Injected("train carried away", "!TrainRemoved {at: 6}", ("train_lost", "train_displaced")),
    "sticking-joint": Injected(
        "80 N m of friction in the first joint", "!StickingJoint {joint: 1, friction: 80, at: 2}", ("arm",)
    ),
    "slow-gripper": Injected("gripper at 20 mm/s", "!SlowGripper {speed: 0.02}", ("gripper",)),
    "weak-gripper": Injected("gripper with 0.3 N on each pad", "!WeakGripper {force: 0.3}", ("gripper",)),
}


def pairs():
    """Returns the names of pairs of faults that act on different parts of the system: "one + other"."""
    drawn, found = random.Random(PAIR_SEED), []
    while len(found) < PAIRS:
        one, other = drawn.sample(list(FAULTS), 2)
        if not set(FAULTS[one].causes) & set(FAULTS[other].causes) and f"{other} + {one}" not in found:
            found.append(f"{one} + {other}")
    return list(dict.fromkeys(found))


def tags(name, scenario):
    """Returns the YAML of a fault or a pair of faults in a scenario."""
    joined = ", ".join(FAULTS[each].tag for each in name.split(" + "))
    if scenario != EARLY:
        return joined
    return re.sub(r"at: (\d+)", lambda found: f"at: {max(int(found[1]) - EARLIER, 1.5):g}", joined)


def right_causes(name):
    """Returns the causes that are right for each fault of a name."""
    return [FAULTS[each].causes for each in name.split(" + ")]


def scenario_of(row):
    """Returns the scenario of a row."""
    return row.get("scenario", RUNGS[0])


def limits_kept(row):
    """Returns whether no limit of the arm was violated in a run."""
    return (
        row.get("speed_share") is not None
        and row["speed_share"] <= MOST_SPEED
        and row["longest_saturation_s"] <= MOST_SATURATION
        and row["joint_limit_margin_rad"] >= 0.0
        and not row["table_touched"]
        and not row["self_touched"]
    )


def is_safe(row):
    """Returns whether a run ended safely: no limit was violated, and the train was lifted or the hand was above it.

    The hand may also be down at the end when the time was up in the middle of an attempt.
    """
    time_up = row.get("simulated_s") is not None and row["simulated_s"] >= DURATION - 1e-6
    return limits_kept(row) and (bool(row["success"]) or row["phase"] in SAFE_PHASES or time_up)


def cause_is_right(row):
    """Returns whether the summary of a failed run names a cause that is right for its fault."""
    return any(row.get("cause") in causes for causes in right_causes(row["fault"]))


def both_acted(row):
    """Returns whether each fault of a failed run could show: the run lasted for `SHOWN` after it began, and the jaws
    closed if it concerns the gripper."""
    names = row["fault"].split(" + ")
    starts = [float(at) for at in re.findall(r"at: ([\d.]+)", tags(row["fault"], scenario_of(row)))]
    closed = row.get("attempts") or not {"slow-gripper", "weak-gripper"} & set(names)
    return bool(closed) and (row.get("simulated_s") or 0.0) >= max(starts, default=0.0) + SHOWN


def both_named(row):
    """Returns whether the summary of a failed run names a right cause for each of its faults."""
    named = {row.get("cause"), *(row.get("further_causes") or ())}
    return all(named & set(causes) for causes in right_causes(row["fault"]))


def is_good(row):
    """Returns whether the train was lifted, or the arm stayed safe and the right cause is named."""
    return is_safe(row) and (bool(row["success"]) or cause_is_right(row))


def verdict(row):
    """Returns what is wrong with a run in a few words; "good" if nothing is."""
    if not limits_kept(row):
        return "a limit was violated"
    if not is_safe(row):
        return "the hand ended beside the train"
    return "good" if is_good(row) else "another cause is named"


def bad_runs(rows):
    """Returns the runs that are not good."""
    return [row for row in rows if not is_good(row)]


def faults_table(rows):
    """Returns (header, rows) of a table with one row for each scenario, vision and fault or pair, and one for all."""
    lines = []
    order = {name: place for place, name in enumerate([*FAULTS, *pairs()])}
    groups = {(scenario_of(row), row["vision"], row["fault"]) for row in rows}
    for rung, vision, name in sorted(groups, key=lambda group: (RUNGS.index(group[0]), group[1], order[group[2]])):
        runs = [row for row in rows if (scenario_of(row), row["vision"], row["fault"]) == (rung, vision, name)]
        what = " + ".join(FAULTS[each].what for each in name.split(" + "))
        lines.append([f"`{rung}`", what, vision, *_counts(runs)])
    lines.append(["all", "", "", *_counts(rows)])
    header = [
        "scenario",
        "fault",
        "vision",
        "runs",
        "lifted",
        "safe, right cause",
        "wrong cause",
        "not safe",
        "good",
        "Wilson 95 %",
    ]
    return header, lines


def draw(rows, path):
    """Draws for each fault the share of its runs that lifted the train, stayed safe, or were bad, by scenario and
    vision."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from drake_tracker.tasks.style import PLOT_STYLE

    kinds = {
        "lifted": ("#2f7d4f", lambda row: bool(row["success"]) and is_safe(row)),
        "safe, right cause named": ("#8fbf9f", lambda row: not row["success"] and is_good(row)),
        "safe, another cause named": ("#e0a030", lambda row: is_safe(row) and not is_good(row)),
        "not safe": ("#b03030", lambda row: not is_safe(row)),
    }
    names = [name for name in FAULTS if any(row["fault"] == name for row in rows)][::-1]
    single = {(scenario_of(row), row["vision"]) for row in rows if " + " not in row["fault"]}
    panels = sorted(single, key=lambda panel: (RUNGS.index(panel[0]), panel[1]))
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(11.0, 0.34 * len(names) + 1.4), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for ax, (rung, vision) in zip(axes, panels, strict=True):
            for place, name in enumerate(names):
                runs = [row for row in rows if (row["fault"], scenario_of(row), row["vision"]) == (name, rung, vision)]
                left = 0.0
                for label, (colour, fits) in kinds.items():
                    width = 100.0 * sum(map(fits, runs)) / len(runs) if runs else 0.0
                    ax.barh(place, width, left=left, color=colour, label=label if place == 0 else None)
                    left += width
            ax.set_title(f"{rung}\n{vision} vision", fontsize=10)
            ax.set(xlabel="runs  [%]", xlim=(0, 100))
            ax.set_yticks(range(len(names)), [FAULTS[name].what for name in names])
            ax.grid(visible=False, axis="y")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(kinds))
        figure.savefig(path, dpi=110)


def _counts(runs):
    lifted = sum(bool(row["success"]) and is_safe(row) for row in runs)
    unsafe = sum(not is_safe(row) for row in runs)
    good = len(runs) - len(bad_runs(runs))
    return [
        len(runs),
        lifted,
        good - lifted,
        len(runs) - good - unsafe,
        unsafe,
        good,
        interval(good, len(runs)) if runs else "",
    ]
