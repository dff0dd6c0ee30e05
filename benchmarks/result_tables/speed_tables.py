"""The tables of the benchmarks that measure time, from their results."""

import statistics

GOALS = {
    "whole, one process": 1.8,
    "recorded, one process": 1.4,
    "train:learned": 1.8,
    "train:guided": 1.45,
    "train:wrist": 1.0,
    "train:two": 1.3,
    "train:guided, recorded": 1.15,
    "conveyor": 1.0,
    "ball, one process": 1.4,
}
"""{loop: smallest real-time factor of the median turn that we want}."""


def loops_table(results):
    """Returns (header, rows) of the loops: real-time factor, its extremes over the turns, processor time."""
    lines = [
        [
            name,
            f"{row['real_time_factor']:.2f}",
            f"{row['slowest']:.2f}",
            f"{row['fastest']:.2f}",
            f"{GOALS[name]:g}" if name in GOALS else "",
            f"{row['processor_s']:.2f}",
            f"{row['rendering_s']:.2f}" if row["rendering_s"] else "",
        ]
        for name, row in results["loops"].items()
    ]
    header = ["loop", "real-time factor", "slowest turn", "fastest turn", "goal"]
    return [*header, "processor time per simulated second [s]", "of which in processes that render [s]"], lines


def stages_table(results):
    """Returns (header, rows) of ratios and of the initialisation of the ball."""
    loops = results["loops"]
    whole = loops["whole, two processes"]["real_time_factor"]
    start = results["ball_initialisation"]
    lines = [
        ["two processes against in process, train", f"{whole / loops['whole, in process']['real_time_factor']:.2f}"],
        [
            "two processes against in process, ball",
            f"{loops['ball, two processes']['real_time_factor'] / loops['ball, in process']['real_time_factor']:.2f}",
        ],
        ["initialisation of the ball, wall time [s]", f"{start['wall_s']:.1f}"],
        ["initialisation of the ball, processor time [s]", f"{start['processor_s']:.1f}"],
    ]
    return ["quantity", "value"], lines


def watchers_table(results):
    """Returns (header, rows) of the runs with and without a page: real-time factor, its extremes, processor time."""
    lines = []
    for kind, costs in results["costs"].items():
        walls = [wall for wall, _ in costs]
        factors = [1.0 / wall for wall in (statistics.median(walls), max(walls), min(walls))]
        processor = statistics.median(processor for _, processor in costs)
        lines.append([kind, len(costs), *(f"{factor:.2f}" for factor in factors), f"{processor:.2f}"])
    header = ["run", "runs", "real-time factor", "slowest run", "fastest run"]
    return [*header, "processor time of the simulation per simulated second [s]"], lines


def start_up_table(results):
    """Returns (header, rows) of start-up times, and of the size of a recording."""
    lines = [
        [what, f"{statistics.median(times):.2f} s", f"{min(times):.2f} to {max(times):.2f} s", len(times)]
        for what, times in results["seconds"].items()
    ]
    size = f"{1e-6 * results['recording_bytes']:.1f} MB"
    lines.append([f"`recording.html` of {results['recording_s']:g} s, size", size, "", 1])
    return ["what", "median", "smallest and largest", "runs"], lines


def campaigns_table(results):
    """Returns (header, rows) of the trials per minute of a campaign by number of workers."""
    rates = {int(count): found for count, found in results["trials_a_minute"].items()}
    medians = {count: statistics.median(found) for count, found in rates.items()}
    first = min(rates)
    lines = []
    for count, found in rates.items():
        extremes = f"{min(found):.1f} to {max(found):.1f}"
        lines.append([count, f"{medians[count]:.1f}", extremes, f"{medians[count] / medians[first]:.2f}"])
    return ["workers", "trials per minute", "slowest and fastest turn", f"times {first} worker"], lines


def methods_table(methods):
    """Returns (header, rows) of what `compare` returned."""
    lines = [
        [name, f"{row['median_us']:.0f}", f"{row['rms_px']:.2f}", f"{row['times_default']:.1f}"]
        for name, row in methods.items()
    ]
    return ["method", "time [us]", "error, rms [px]", "time / default"], lines


def renderers_table(found):
    """Returns (header, rows) of the time of one image with several renderers."""
    drake = statistics.median(found["renderers"]["Drake, RenderEngineVtk"]["ms"])
    lines = [
        [name, row["version"], f"{statistics.median(row['ms']):.1f}", f"{min(row['ms']):.1f} to {max(row['ms']):.1f}"]
        + [f"{statistics.median(row['ms']) / drake:.2f}"]
        for name, row in found["renderers"].items()
    ]
    return ["renderer", "version", "time of an image [ms]", "fastest and slowest turn", "time / Drake's"], lines


def environment_table(found):
    """Returns (header, rows) of the speed of the environment, and of the equality of its episodes."""
    goals = {"points, 1 environment": 3, "points, 2 environments": 5, "two cameras, 1 environment": 1}
    lines = [["import to first step", f"{statistics.median(found['first_step_s']):.1f} s", "4 s"]]
    for name, factor in found["real_time_factor"].items():
        steps = statistics.median(found["steps_per_s"][name])
        goal = f"{goals[name]} x real time" if name in goals else ""
        lines.append([name, f"{factor:.1f} x real time, {steps:.0f} steps/s", goal])
    lines += [
        [f"episodes that are the same {name} as alone", f"{count} of {found['episodes']}", "all"]
        for name, count in found["equal"].items()
    ]
    return ["what", "measured", "goal"], lines
