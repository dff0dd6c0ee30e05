"""Figure 15 of Allen et al. 1991: bending over arc length becomes curvature (equations 5 and 19)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.figures.paper_style import head, quiet_grid, sheet
from drake_tracker.tasks.style import FAR_PREDICTED, HAND, INK, PREDICTED, RULE, SOFT_INK

SPEED = 0.15
"""Speed of the train on the oval [m/s]."""
INTERVALS = VISION_PERIOD * np.geomspace(1.0, 60.0, 18)
"""Sampling intervals T [s]."""
PLACE = 0.13
"""Where on the oval the curvature is computed [fraction of a lap]: away from its axes, where the curvature changes."""
_TURN = np.deg2rad(38.0)
"""Angle at the centre between neighbouring points of the drawing [rad]."""


def curvature_limit() -> dict[str, Any]:
    """Returns the numbers of the right panel: tan(phi_0) / s_0 [1/m] of three points on the oval, T [s] apart."""
    semi_axes = np.array([0.16, 0.22])
    fine = np.linspace(0.0, 2.0 * np.pi, 200001)
    curve = semi_axes * np.column_stack([np.cos(fine), np.sin(fine)])
    distance = np.append(0.0, np.cumsum(np.hypot(*np.diff(curve, axis=0).T)))
    place = PLACE * distance[-1]
    angle = np.interp(place, distance, fine)
    a, b = semi_axes
    truth = a * b / (a**2 * np.sin(angle) ** 2 + b**2 * np.cos(angle) ** 2) ** 1.5
    ratios = []
    for interval in INTERVALS:
        at = np.interp(place + SPEED * interval * np.array([-1.0, 0.0, 1.0]), distance, fine)
        before, now, after = (a * np.cos(at) + 1j * b * np.sin(at)).tolist()
        ratios.append(np.tan(np.angle((after - now) / (now - before))) / abs(after - now))
    found = np.array(ratios)
    return {
        "track": "oval",
        "speed_m_s": SPEED,
        "curvature_1_m": truth,
        "interval_s": INTERVALS,
        "tan_phi_0_over_s_0_1_m": found,
        "relative_error": found / truth - 1.0,
    }


def draw_curvature(numbers: Mapping[str, Any]) -> Figure:
    """Returns figure 15, with a panel that shows how fast the limit is reached."""
    with sheet(12.0, 5.4) as figure:
        left, right = figure.subplots(1, 2)
        _draw_construction(left)
        head(left, "Figure 15 · Bending and curvature", "Three consecutive points, their tangents and chords.")
        interval = 1000.0 * numbers["interval_s"]
        right.loglog(interval, 100.0 * np.abs(numbers["relative_error"]), "o-", color=PREDICTED, lw=1.8, ms=5)
        right.axvline(interval[0], color=SOFT_INK, lw=1.0, ls=(0, (4, 3)), zorder=0)
        right.annotate(
            "60 Hz",
            (interval[0], 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(5, -4),
            va="top",
            textcoords="offset points",
            color=SOFT_INK,
        )
        right.set(
            xticks=[20, 50, 100, 200, 500, 1000],
            xlabel="sampling interval $T$  [ms]",
            ylabel="error of $\\tan\\phi_0/s_0$ as curvature  [%]",
        )
        right.xaxis.set_major_formatter("{x:g}")
        right.xaxis.set_minor_formatter("")
        right.yaxis.set_major_formatter("{x:g}")
        quiet_grid(right)
        head(
            right,
            "Equation (5) in numbers",
            f"On the oval at {numbers['speed_m_s']:g} m/s, "
            f"where $\\kappa$ = {numbers['curvature_1_m']:.2f} 1/m; no noise.",
        )
    return figure


def _draw_construction(axes: Axes) -> None:
    angles = 0.5 * np.pi + _TURN * np.array([1.0, 0.0, -1.0])  # to the right, bending down
    points = np.column_stack([np.cos(angles), np.sin(angles)])
    arc = np.linspace(angles[0] + 0.3, angles[-1] - 0.3, 200)
    axes.plot(np.cos(arc), np.sin(arc), color=INK, lw=2.2, zorder=2)
    for point in points:
        axes.plot([0, point[0]], [0, point[1]], color=RULE, lw=1.2, zorder=0)
    for angle, point, name in zip(angles, points, ("k-1", "k", "k+1")):
        along = np.array([np.sin(angle), -np.cos(angle)])
        ends = np.array([point - 0.10 * along, point + 0.46 * along])
        axes.annotate("", ends[1], ends[0], arrowprops=dict(arrowstyle="-|>", color=HAND, lw=1.5, shrinkA=0, shrinkB=0))
        axes.annotate(f"$t_{{{name}}}$", ends[1], xytext=(5, 0), textcoords="offset points", color=HAND, va="center")
        outward = point * {"k-1": 0.87, "k": 1.1, "k+1": 0.87}[name]
        axes.text(*outward, f"$P_{{{name}}}$", ha="center", va="center", weight="bold")
    before, now, after = points
    axes.plot(*points.T, color=PREDICTED, lw=2.0, zorder=3)
    beyond = now + 0.62 * (now - before)
    axes.plot(*np.array([now, beyond]).T, color=PREDICTED, lw=1.2, ls=(0, (4, 3)), zorder=1)
    axes.plot(*points.T, "o", color=INK, ms=7, zorder=4)
    _mark_angle(axes, now, after - now, now - before, 0.25, "$\\phi_0$", FAR_PREDICTED, at=0.7)
    _mark_angle(axes, (0, 0), now, before, 0.26, "$\\varphi_k$", SOFT_INK)
    _mark_angle(axes, (0, 0), after, now, 0.32, "$\\varphi_{k+1}$", SOFT_INK)
    middle = 0.5 * (now + after)
    axes.text(*(0.91 * middle), "$s_0$", color=PREDICTED, ha="center", va="center")
    axes.plot(0, 0, "o", color=SOFT_INK, ms=5)
    axes.text(-0.05, -0.07, "$O$", color=SOFT_INK)
    axes.text(0.0, -0.16, "$\\phi_0 = (\\varphi_k + \\varphi_{k+1})/2$", color=FAR_PREDICTED, ha="center", va="top")
    axes.set_aspect("equal", anchor="N")
    axes.set(xlim=(-1.05, 1.25), ylim=(-0.26, 1.2), xticks=[], yticks=[])
    axes.spines[:].set_visible(False)


def _mark_angle(
    axes: Axes,
    corner: ArrayLike,
    low: np.ndarray,
    high: np.ndarray,
    radius: float,
    name: str,
    colour: str,
    at: float = 0.5,
) -> None:
    """Draws an arc from direction ``low`` to ``high``, both (2,), about ``corner``.

    Its name stands at the fraction ``at`` of the arc.
    """
    x, y = np.asarray(corner)
    start, end = (np.arctan2(direction[1], direction[0]) for direction in (low, high))
    turn = np.linspace(start, end, 40)
    axes.plot(x + radius * np.cos(turn), y + radius * np.sin(turn), color=colour, lw=1.5, zorder=3)
    middle = start + at * (end - start)
    axes.text(
        x + 1.28 * radius * np.cos(middle),
        y + 1.28 * radius * np.sin(middle),
        name,
        color=colour,
        ha="center",
        va="center",
    )
