"""The table and the chart of `success_law.py`."""

import numpy as np
from shared.common import interval
from success_law import CELLS, predicted

from drake_tracker.campaign.rates import wilson
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.success_law import LAW, UNCERTAINTY, HandLimits, Situation, bends, predict

CURVATURES = (4.0, 8.0, 16.0, 32.0)
"""Of the bends in the chart [1/m]."""
STRAIGHT = 0.15
"""Length of the straights between the bends in the chart [m]."""
LAGS = (0.05, 0.25, 0.5)
"""Lags of vision in the chart [s]."""
PUMA = HandLimits(0.647, 5.453, 14.053)
"""Limits of the PUMA 560's hand (`success_law.hand_limits`)."""


def cells_of(rows):
    """Returns [cell, runs, predicted share, lifted] of each cell that was run, in the order of `CELLS`."""
    found = []
    for cell in CELLS:
        runs = [row for row in rows if row["cell"] == cell and row["end"] != "refused"]
        if runs:
            found.append([cell, len(runs), float(predicted(LAW, runs).mean()), sum(row["lifted"] for row in runs)])
    return found


def law_table(rows):
    """Returns (header, rows): the share of each cell beside the prediction."""
    header = ["cell", "runs", "predicted", "lifted", "Wilson 95 %", "difference"]
    found = []
    for cell, count, chance, lifted in cells_of(rows):
        share = lifted / count
        difference = f"{100 * (share - chance):+.0f}"
        found.append(
            [cell, count, f"{100 * chance:.0f} %", f"{100 * share:.0f} %", interval(lifted, count), difference]
        )
    return header, found


def within(rows):
    """Returns (cells whose share is within `UNCERTAINTY` of the prediction, cells)."""
    cells = cells_of(rows)
    return sum(abs(lifted / count - chance) <= UNCERTAINTY for _, count, chance, lifted in cells), len(cells)


def draw(rows, path):
    """Draws the success over what the object moves unseen, and the cells over their predictions."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from drake_tracker.tasks.style import PLOT_STYLE

    grasp = GraspConfig(descent="guided")
    speeds = np.linspace(0.01, 1.0, 100)
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(13, 5.4), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        for k, curvature in enumerate(CURVATURES):
            path_bends = bends(curvature, STRAIGHT)
            for lag, line in zip(LAGS, (":", "-", "--")):
                chance = [predict(LAW, Situation(v, lag, 0.0015, path_bends, PUMA, grasp))[0] for v in speeds]
                label = f"radius {1e3 / curvature:.0f} mm" if line == "-" else None
                left.plot(speeds, 100.0 * np.array(chance), line, color=f"C{k}", label=label)
        bound = [predict(LAW, Situation(v, 0.25, 0.0015, bends(8.0, STRAIGHT), PUMA, grasp))[1] for v in speeds]
        left.plot(speeds, 100.0 * np.array(bound), color="0.35", lw=2.5, label="perfect prediction, radius 125 mm")
        left.set(
            xlabel="speed of the object  [m/s]", ylabel="lifted at the first descent  [%]", ylim=(0, 103), xlim=(0, 1)
        )
        left.set_title("Lag of vision 0.05 s (dotted), 0.25 s and 0.5 s (dashed)")
        left.legend(loc="upper right")
        for _, count, chance, lifted in cells_of(rows):
            low, high = wilson(lifted, count)
            middle = lifted / count
            error = [[100 * (middle - low)], [100 * (high - middle)]]
            right.errorbar(100 * chance, 100 * middle, yerr=error, fmt="o", color="C0", ms=5)
        ends = np.array([0.0, 100.0])
        right.plot(ends, ends, color="0.35")
        right.fill_between(ends, ends - 100 * UNCERTAINTY, ends + 100 * UNCERTAINTY, color="0.85", lw=0)
        right.set(xlabel="predicted  [%]", ylabel="lifted  [%]", xlim=(0, 100), ylim=(0, 103))
        right.set_title("New arms, paths and estimators")
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110)
    print(f"wrote {path}")
