"""The table and the chart of `success_law.py`."""

import numpy as np
from methods.law_fit import predicted
from shared.common import interval, percent

from drake_tracker import load_scenario
from drake_tracker.campaign.rates import wilson
from drake_tracker.grasp.success_law import LAW, Situation, bends, joint_shares, predict
from drake_tracker.tasks.train.setup import resolve

RADII = (0.25, 0.125, 0.06)
"""Of the bends in the chart [m]."""
STRAIGHT, NOISE = 0.15, 0.0015
"""Length of the straights between the bends [m], and standard deviation of a measured point [m], in the chart."""
SPEEDS, LAGS = np.linspace(0.02, 1.0, 66), np.linspace(0.0, 0.5, 31)
LEVELS = (0, 20, 50, 80, 95, 100)
"""Between the shades of the chart [%]."""
TOLERANCE = 0.07
"""Difference up to which a prediction counts as right."""


def cells_of(rows):
    """Returns [cell, runs, predicted share, lifted] of each cell, in the order of the runs."""
    found = []
    for cell in dict.fromkeys(row["cell"] for row in rows if row["part"] == "cells"):
        runs = [row for row in rows if row["cell"] == cell and row["end"] != "refused"]
        found.append([cell, len(runs), float(predicted(LAW, runs).mean()), sum(row["lifted"] for row in runs)])
    return found


def law_table(rows):
    """Returns (header, rows): the share of each cell beside the prediction."""
    header = ["cell", "runs", "predicted", "lifted", "Wilson 95 %", "difference"]
    found = []
    for cell, count, chance, lifted in cells_of(rows):
        share = lifted / count
        difference = f"{100 * (share - chance):+.0f}"
        found.append([cell, count, percent(chance), percent(share), interval(lifted, count), difference])
    return header, found


def within(rows):
    """Returns (cells whose share is within `TOLERANCE` of the prediction, largest difference, cells)."""
    differences = [abs(lifted / count - chance) for _, count, chance, lifted in cells_of(rows)]
    return sum(value <= TOLERANCE for value in differences), max(differences), len(differences)


def draw(rows, path):
    """Draws the success over speed and lag for each radius, and the cells over their predictions."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from drake_tracker.tasks.style import PLOT_STYLE

    setup = resolve(load_scenario("train:guided"))
    taken, grasp = joint_shares(setup.reach.model, setup.reach.q_initial), setup.grasp
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(11, 9), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(2, 2)
        for ax, radius in zip(axes.flat, RADII):
            path_bends = bends(1.0 / radius, STRAIGHT)
            found = np.array(
                [
                    [predict(LAW, Situation(v, lag, NOISE, path_bends, taken, grasp)) for v in SPEEDS]
                    for lag in LAGS
                ]
            )  # fmt: skip
            shades = ax.contourf(SPEEDS, LAGS, 100.0 * found[..., 0], LEVELS, cmap="RdYlGn", alpha=0.75)
            lines = ax.contour(SPEEDS, LAGS, 100.0 * found[..., 0], LEVELS[1:4], colors="0.2", linewidths=0.8)
            ax.clabel(lines, fmt="%g %%")
            bound = ax.contour(SPEEDS, LAGS, 100.0 * found[..., 1], (50,), colors="k", linewidths=2.5)
            ax.clabel(bound, fmt="perfect prediction, 50 %%")
            ax.set(xlabel="speed of the object  [m/s]", ylabel="lag of vision  [s]")
            ax.set_title(f"bends of radius {1e3 * radius:.0f} mm")
        figure.colorbar(shades, ax=axes[:, 0], label="lifted at the first descent  [%]", location="left")
        check = axes.flat[-1]
        for _, count, chance, lifted in cells_of(rows):
            low, high = wilson(lifted, count)
            middle = lifted / count
            error = [[100 * (middle - low)], [100 * (high - middle)]]
            check.errorbar(100 * chance, 100 * middle, yerr=error, fmt="o", color="C0", ms=5)
        ends = np.array([0.0, 100.0])
        check.plot(ends, ends, color="0.35")
        check.fill_between(ends, ends - 100 * TOLERANCE, ends + 100 * TOLERANCE, color="0.85", lw=0)
        check.set(xlabel="predicted  [%]", ylabel="lifted  [%]", xlim=(0, 100), ylim=(0, 103))
        check.set_title("twelve cells, measured")
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=80, pil_kwargs={"optimize": True})
    print(f"wrote {path}")
