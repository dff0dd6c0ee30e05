"""Plots of the rates of a campaign: over one setting, or as a map over two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_tracker.campaign.grid import plain_value
from drake_tracker.campaign.rates import Rate
from drake_tracker.tasks.style import INK, PLOT_STYLE, PREDICTED, RULE, SOFT_INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

COLOURS = (PREDICTED, "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", SOFT_INK)
"""Colours of the lines, in turn."""
MAP_SIZE = 2
"""Number of values that a setting must have, at least, to be an axis of a map."""


def draw_rates(
    rates: Sequence[Rate], keys: Sequence[str], units: Mapping[str, str] | None = None, title: str = ""
) -> Figure | None:
    """Returns a Matplotlib figure of the rates of a campaign, or None when nothing was varied or nothing has run.

    Two numeric settings make a map. Otherwise the rates are drawn with their Wilson intervals over the first numeric
    setting (or, when none is numeric, over the first setting), with a line for each combination of the others.

    Args:
        rates: of the cells.
        keys: the varied settings.
        units: {key: unit}.
        title: of the axes.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rates = [rate for rate in rates if rate.trials]
    if not keys or not rates:
        return None
    numeric = [key for key in keys if all(_is_number(rate.settings[key]) for rate in rates)]
    values = {key: list(dict.fromkeys(rate.settings[key] for rate in rates)) for key in keys}
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(8.0, 4.8), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        if len(keys) == len(numeric) == 2 and all(len(values[key]) >= MAP_SIZE for key in keys):
            _map(figure, axes, rates, keys, units or {})
        else:
            draw_lines(axes, rates, keys, (numeric or keys)[0], bool(numeric), units or {})
        axes.set_title(title)
    return figure


def draw_map(
    axes: Axes, shares: Mapping[tuple[Any, Any], float | None], columns: Sequence[Any], rows: Sequence[Any]
) -> AxesImage:
    """Draws a map of rates. Returns its image, for a colour bar.

    Args:
        axes: Matplotlib axes to draw into.
        shares: {(value of the column, value of the row): rate from 0 to 1}; missing cells stay white.
        columns: numbers along the horizontal axis, in order.
        rows: numbers along the vertical axis, in order.
    """
    share = np.full((len(rows), len(columns)), np.nan)
    for (column, row), value in shares.items():
        share[rows.index(row), columns.index(column)] = np.nan if value is None else 100.0 * value
    image = axes.imshow(share, origin="lower", cmap="viridis", vmin=0, vmax=100, aspect="auto")
    for (row, column), value in np.ndenumerate(share):
        if np.isfinite(value):
            colour = "black" if value > 60 else "white"
            axes.text(column, row, f"{value:.0f}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(columns)), [f"{value:g}" for value in columns])
    axes.set_yticks(range(len(rows)), [f"{value:g}" for value in rows])
    axes.spines[:].set_visible(False)
    return image


def _map(figure: Figure, axes: Axes, rates: Sequence[Rate], keys: Sequence[str], units: Mapping[str, str]) -> None:
    shares = {(plain_value(rate.settings[keys[0]]), plain_value(rate.settings[keys[1]])): rate.share for rate in rates}
    columns, rows = (sorted({cell[k] for cell in shares}) for k in (0, 1))
    image = draw_map(axes, shares, columns, rows)
    axes.set(xlabel=_label(keys[0], units), ylabel=_label(keys[1], units))
    figure.colorbar(image, ax=axes, label="success rate  [%]", pad=0.02)


def draw_lines(
    axes: Axes, rates: Sequence[Rate], keys: Sequence[str], key: str, numeric: bool, units: Mapping[str, str]
) -> None:
    """Draws rates with their Wilson intervals over one setting, a line for each combination of the others.

    Args:
        axes: Matplotlib axes to draw into.
        rates: of the cells.
        keys: the varied settings.
        key: the setting along the horizontal axis.
        numeric: whether its values are numbers.
        units: {key: unit}.
    """
    groups: dict[str, list[Rate]] = {}
    for rate in rates:
        rest = ", ".join(f"{other.rpartition('.')[2]} {rate.settings[other]}" for other in keys if other != key)
        groups.setdefault(rest, []).append(rate)
    names = list(dict.fromkeys(rate.settings[key] for rate in rates))
    places: dict[str, Any] = {name: plain_value(name) if numeric else k for k, name in enumerate(names)}
    span = max(places.values()) - min(places.values()) or 1.0
    for k, (label, group) in enumerate(groups.items()):
        group.sort(key=lambda rate: places[rate.settings[key]])
        shift = 0.012 * span * (k - (len(groups) - 1) / 2)  # otherwise intervals hide each other
        x = [places[rate.settings[key]] + shift for rate in group]
        share, low, high = (100.0 * np.array([getattr(r, name) for r in group]) for name in ("share", "low", "high"))
        axes.errorbar(
            x,
            share,
            [np.maximum(share - low, 0.0), np.maximum(high - share, 0.0)],
            fmt="o-" if numeric else "o",
            color=COLOURS[k % len(COLOURS)],
            capsize=3,
            lw=1.5,
            ms=5,
            label=label,
        )
    axes.set(xlabel=_label(key, units), ylabel="success rate  [%], Wilson 95 %", ylim=(-3, 103))
    axes.set_xticks(list(places.values()), names)
    axes.grid(axis="y", color=RULE, lw=0.5)
    axes.tick_params(colors=INK)
    if len(groups) > 1:
        axes.legend(frameon=False)


def _label(key: str, units: Mapping[str, str]) -> str:
    return f"{key}  [{units[key]}]" if units.get(key) else key


def _is_number(text: str) -> bool:
    value = plain_value(text)
    return isinstance(value, (int, float)) and not isinstance(value, bool)
