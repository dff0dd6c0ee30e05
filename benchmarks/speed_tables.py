"""The tables of `real_time.py` and `centroid_speed.py`, from their results."""


def loops_table(results):
    """Returns (header, rows) of the loops: real-time factor, its extremes over the turns, processor time."""
    lines = [
        [
            name,
            f"{row['real_time_factor']:.2f}",
            f"{row['slowest']:.2f}",
            f"{row['fastest']:.2f}",
            f"{row['processor_s']:.2f}",
            f"{row['rendering_s']:.2f}" if row["rendering_s"] else "",
        ]
        for name, row in results["loops"].items()
    ]
    header = ["loop", "real-time factor", "slowest turn", "fastest turn"]
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


def methods_table(methods):
    """Returns (header, rows) of what `compare` returned."""
    lines = [
        [name, f"{row['median_us']:.0f}", f"{row['rms_px']:.2f}", f"{row['times_default']:.1f}"]
        for name, row in methods.items()
    ]
    return ["method", "time [us]", "error, rms [px]", "time / default"], lines
