"""The tables of `ball_detectors.py`, from its results."""

import math

from shared.common import percent

CONDITIONS = (
    *("steady light", "flicker 5 %, 120.12 Hz", "flicker 5 %, 100 Hz"),
    *("camera shaken", "board knocked", "interlaced camera"),
)
"""Conditions in the short table."""
SPEEDS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 12.0)
"""Edges [px between the images used] of the bins of the ball's speed."""


def show(value, form):
    """Returns a number as a text, empty without one."""
    return "" if value is None or not math.isfinite(value) else format(value, form)


def short_table(results, methods, default):
    """Returns (header, rows): errors, share found in each condition, time.

    Args:
        results: what `ball_detectors.py` writes.
        methods: {label: name in the results} of the rows.
        default: the name in the results of the method whose time is 1.
    """
    ball, train, times = (results[key] for key in ("ball", "train", "time_us"))
    rows = [
        [
            label + (" (default)" if name == default else ""),
            show(ball["steady light"][name].get("rms_mm"), ".1f"),
            *(percent(ball[condition][name]["within"]) for condition in CONDITIONS),
            show(train["steady light"][name]["rms_px"], ".2f"),
            f"{times[name] / times[default]:.1f}",
        ]
        for label, name in methods.items()
    ]
    found = [f"found, {condition}" for condition in CONDITIONS]
    return ["method", "ball: error, rms [mm]", *found, "train: error, rms [px]", "time / default"], rows


def both_tasks_table(results, default):
    """Returns (header, rows): the ball in steady light and the train, method by method."""
    ball, train = (results[key]["steady light"] for key in ("ball", "train"))
    times = results["time_us"]
    rows = []
    for name, on_train in train.items():
        on_ball, cells = ball.get(name), [""] * 6
        if on_ball is not None:
            cells = [
                percent(on_ball["within"]),
                *(show(on_ball.get(key), form) for key, form in (("median_px", ".2f"), ("rms_px", ".2f"))),
                *(show(on_ball.get(key), ".1f") for key in ("median_mm", "rms_mm")),
                f"{times[name] / times[default]:.1f}",
            ]
        bias = "" if on_train["bias_px"] is None else f"{math.hypot(*on_train['bias_px']):.2f}"
        found = [percent(on_train["within"]), show(on_train["rms_px"], ".2f"), bias, show(on_train["jitter_px"], ".2f")]
        rows.append([name, *cells, *found])
    header = ["ball: within", "median [px]", "rms [px]", "median [mm]", "rms [mm]", "time / default"]
    return ["method", *header, "train: within", "rms [px]", "bias [px]", "jitter [px]"], rows


def conditions_table(table):
    """Returns (header, rows): the share within one diameter or length, and the median error [px], by condition."""
    rows = []
    for name in table["steady light"]:
        cells = [found[name] for found in table.values()]
        rows.append([name, *(f"{percent(cell['within'])} ({show(cell['median_px'], '.1f') or '-'})" for cell in cells)])
    return ["method", *table], rows


def speeds_table(speeds):
    """Returns (header, rows): share within, rms [px], speed found over the true speed, by the ball's speed."""
    rows = []
    for name, parts in speeds.items():
        texts = [
            [percent(part["within"]), show(part["rms_px"], ".2f"), show(part["speed_ratio"], ".2f")] for part in parts
        ]
        rows.append([name, *(", ".join(cell for cell in text if cell) or "-" for text in texts)])
    rows.append(["images", *(str(part["images"]) for part in next(reversed(speeds.values())))])
    return ["method", *(f"{low:g}-{high:g}" for low, high in zip(SPEEDS[:-1], SPEEDS[1:]))], rows
