"""The tables of `real_time.py` and `centroid_speed.py`, from their results."""


def loops_table(results):
    """Returns (header, rows) of the loops: real-time factor, its extremes over the turns where stored, wall time."""
    lines, extremes = [], results.get("slowest_and_fastest", {})
    for name, factor in results["real_time_factor"].items():
        ends = ["{:.2f}-{:.2f}".format(*extremes[name])] if extremes else []
        lines.append([name, f"{factor:.2f}", *ends, f"{1 / factor:.3f}"])
    header = ["slowest and fastest turn"] if extremes else []
    return ["loop", "real-time factor", *header, "wall time per simulated second [s]"], lines


def stages_table(results):
    """Returns (header, rows) of the stages: wall time per simulated second, share of the whole loop."""
    stages = results["seconds_per_simulated_second"]
    total = sum(stages.values())
    lines = [[name, f"{seconds:.3f}", f"{100 * seconds / total:.0f} %"] for name, seconds in stages.items()]
    return ["stage", "wall time per simulated second [s]", "share of the whole loop"], lines


def methods_table(methods):
    """Returns (header, rows) of what `compare` returned."""
    lines = [
        [name, f"{row['median_us']:.0f}", f"{row['rms_px']:.2f}", f"{row['times_default']:.1f}"]
        for name, row in methods.items()
    ]
    return ["method", "time [us]", "error, rms [px]", "time / default"], lines
