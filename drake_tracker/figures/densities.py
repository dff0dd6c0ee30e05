"""Figures 8, 9 and 10 of Allen et al. 1991: the densities of arc length and bending, and the ratio of moments."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import trapezoid

from drake_tracker.estimation.parts.rice import (
    RATIO_LIMIT,
    arc_length_density,
    bending_density,
    exact_bending_density,
    mean_factor,
    moment_ratio,
    noise_ratio,
)
from drake_tracker.figures.paper_style import head, quiet_grid, shades, sheet
from drake_tracker.tasks.style import FAR_PREDICTED, INK, PREDICTED, RULE, SOFT_INK

SIGMAS = np.round(np.arange(0.4, 1.01, 0.1), 1)
"""Standard deviations of the noise in figure 8, in units of s_0."""
NOISE_RATIOS = np.round(np.arange(0.1, 0.91, 0.1), 1)
"""k = sigma / s_0 of figure 10."""
EXAMPLE_RATIO = 1.03
"""The ratio p whose inversion figure 9 shows."""


def arc_length_densities() -> dict[str, Any]:
    """Returns the numbers of figure 8: for s_0 = 1 and each sigma, the curve with its peak, mean and integral."""
    s = np.linspace(0.0, 6.0, 1201)
    rows = []
    for sigma in SIGMAS:
        density = arc_length_density(s, 1.0, sigma)
        rows.append(
            {
                "sigma": sigma,
                "peak": s[density.argmax()],
                "mean": sigma * mean_factor(1.0 / sigma),
                "integral": trapezoid(density, s),
                "density": density,
            }
        )
    return {"s_0": 1.0, "s": s, "curves": rows}


def draw_arc_length_densities(numbers: Mapping[str, Any]) -> Figure:
    """Returns figure 8."""
    with sheet(8.0, 5.0) as figure:
        axes = figure.subplots()
        for row, colour in zip(numbers["curves"], shades(len(numbers["curves"]))):
            axes.plot(numbers["s"], row["density"], color=colour, lw=2, label=f"{row['sigma']:.1f}")
            axes.plot(row["peak"], row["density"].max(), "o", color=colour, ms=5)
            mean = row["mean"]
            axes.plot(mean, np.interp(mean, numbers["s"], row["density"]), "|", color=colour, ms=14, mew=2)
        axes.axvline(1.0, color=SOFT_INK, lw=1, ls=(0, (4, 3)))
        axes.annotate(
            "true $s_0$",
            (1.0, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(-6, -4),
            ha="right",
            textcoords="offset points",
            color=SOFT_INK,
            va="top",
        )
        axes.set(
            xlim=(0, 4),
            ylim=(0, 1.15),
            xlabel="measured arc length $s$  [units of $s_0$]",
            ylabel="density $f(s)$  [1/$s_0$]",
        )
        quiet_grid(axes)
        axes.legend(title="noise $\\sigma$  [$s_0$]")
        head(
            axes,
            "Figure 8 · Noise makes a path longer",
            "Density of the measured arc length; dots: peaks, bars: means. Both move away from the true value.",
        )
    return figure


def moment_ratios() -> dict[str, Any]:
    """Returns the numbers of figure 9: u_1(x), its limit at x = 0, and one inversion x_0(p) with the filter's table."""
    x = np.linspace(0.0, 8.0, 401)
    return {
        "x": x,
        "u_1": moment_ratio(x),
        "limit": RATIO_LIMIT,
        "example": {"p": EXAMPLE_RATIO, "x_0": noise_ratio(EXAMPLE_RATIO)},
    }


def draw_moment_ratios(numbers: Mapping[str, Any]) -> Figure:
    """Returns figure 9."""
    example = numbers["example"]
    with sheet(8.0, 5.0) as figure:
        axes = figure.subplots()
        axes.axhspan(numbers["limit"], 1.2, color="#f4e3d7", lw=0)
        axes.text(
            7.9,
            numbers["limit"] + 0.006,
            "above $2/\\sqrt{\\pi}$ there is no root: $s_0$ is held",
            ha="right",
            color=FAR_PREDICTED,
        )
        axes.axhline(1.0, color=RULE, lw=1)
        axes.plot(
            [0, example["x_0"], example["x_0"]], [example["p"], example["p"], 0.9], color=INK, lw=1.2, ls=(0, (4, 3))
        )
        axes.plot(numbers["x"], numbers["u_1"], color=PREDICTED, lw=2.4)
        axes.plot(example["x_0"], example["p"], "o", color=INK, ms=6)
        axes.annotate(
            f"measured $p$ = {example['p']:.2f} gives $x_0$ = {example['x_0']:.2f}",
            (example["x_0"], example["p"]),
            xytext=(10, 8),
            textcoords="offset points",
        )
        axes.set(xlim=(0, 8), ylim=(0.99, 1.16), xlabel="$x = s_0/\\sigma$", ylabel="$u_1(x) = s_2/s_1$")
        quiet_grid(axes)
        head(
            axes,
            "Figure 9 · Two moments tell signal from noise",
            "Ratio of the root mean square to the mean of $s$ (equation 16), and its inversion.",
        )
    return figure


def bending_densities() -> dict[str, Any]:
    """Returns the numbers of figure 10: for each k, the paper's density, the exact one, and both integrals.

    Densities in [1/rad] over the whole circle; phi_0 = 0.
    """
    phi = np.linspace(-np.pi, np.pi, 1441)
    rows = []
    for k in NOISE_RATIOS:
        paper, exact = bending_density(phi, 0.0, k), exact_bending_density(phi, 0.0, k)
        rows.append(
            {
                "k": k,
                "paper_integral": trapezoid(paper, phi),
                "exact_integral": trapezoid(exact, phi),
                "paper": paper,
                "exact": exact,
            }
        )
    return {"phi_0": 0.0, "phi": phi, "curves": rows}


def draw_bending_densities(numbers: Mapping[str, Any]) -> Figure:
    """Returns figure 10, with the exact density beside the paper's."""
    degrees = np.rad2deg(numbers["phi"])
    with sheet(12.0, 5.2) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        ahead = np.where(np.abs(degrees) <= 90.0, 1.0, np.nan)
        for axes, which in ((left, "paper"), (right, "exact")):
            tail = axes.inset_axes([0.09, 0.42, 0.33, 0.5])
            for row, colour in zip(numbers["curves"], shades(len(numbers["curves"]))):
                curve = row[which] * (ahead if which == "paper" else 1.0)
                axes.plot(degrees, curve, color=colour, lw=1.8, label=f"{row['k']:.1f}")
                tail.plot(degrees, curve, color=colour, lw=1.5)
            tail.set(xlim=(60, 180), xticks=(60, 90, 120, 180), ylim=(0, 0.25), yticks=(0, 0.1, 0.2))
            tail.tick_params(labelsize=9)
            tail.text(176, 0.235, "the tail", ha="right", va="top", color=SOFT_INK, fontsize=9.5)
            quiet_grid(tail)
            axes.set(
                xlim=(-180, 180), xticks=range(-180, 181, 60), ylim=(0, 4.2), xlabel="bending $\\phi - \\phi_0$  [deg]"
            )
            quiet_grid(axes)
        left.set_ylabel("density $f(\\phi)$  [1/rad]")
        left.legend(title="$k = \\sigma/s_0$")
        worst = numbers["curves"][-1]
        head(
            left,
            "Figure 10 · The paper's density",
            f"Without points behind the object: at k = {worst['k']:.1f} it holds {worst['paper_integral']:.0%}.",
        )
        head(right, "The exact density", "The whole circle; each curve integrates to one.")
    return figure
