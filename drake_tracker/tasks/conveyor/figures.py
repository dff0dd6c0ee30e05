"""The picture of a run of the conveyor: each part along the belt over time, the trays at the end, and the pick rate."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.part_kinds import placed_outline
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.part_history import PartHistory, part_histories
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.episode import Log, phase_spans
from drake_tracker.tasks.plots import draw_phases, name_colours
from drake_tracker.tasks.style import FAR_PREDICTED, HAND, INK, PLOT_STYLE, PREDICTED, RULE, SOFT_INK, phase_colour
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.conveyor_config import cell_centres
from drake_tracker.world.conveyor.part_fates import PartFate

DROPPED, ON_BELT = "#cc79a7", "#8a9099"
FATE_COLOURS = {
    PartFate.PLACED: HAND,
    PartFate.HELD: PREDICTED,
    PartFate.MISSED: FAR_PREDICTED,
    PartFate.DROPPED: DROPPED,
    PartFate.ON_BELT: ON_BELT,
    PartFate.UPSTREAM: ON_BELT,
}
"""{fate at the end: colour of a part}."""
RATE_SPAN = 20.0
"""Length of the interval over which rates are counted [s]."""
_WINDOW, _CELL, _BELT = "#eef4ee", "#c9cdd3", "#e4e6e9"
_BESIDE = 0.06
"""Distance beyond the belt's entry and end that is shown [m]."""


def draw_conveyor(
    setup: ConveyorSetup, arrivals: Sequence[Arrival], log: Log, summary: Mapping[str, Any], path: Path
) -> None:
    """Draws a run as one picture, 3200 x 1800 px.

    Args:
        setup: the resolved scenario of the run.
        arrivals: the parts of the run.
        log: {name: Signal} of the run.
        summary: the return value of `summarise_conveyor`.
        path: PNG file to write.
    """
    histories = part_histories(setup, arrivals, log)
    spans = phase_spans(log, PickPhase, setup.scenario.time_step)
    end = max(float(log["truth_fates"].times[-1]) if len(log["truth_fates"].times) else 0.0, 0.1)
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        FigureCanvasAgg(figure)
        places = ((0.335, 0.470), (0.255, 0.028), (0.065, 0.125))
        belt, strip, rate = (figure.add_axes((0.045, low, 0.70, height)) for low, height in places)
        _draw_belt(belt, setup, histories, log, end)
        draw_phases(strip, spans, 0.0, end)
        strip.set_title("")
        seen = sorted({span.phase for span in spans})
        name_colours(strip, [("Phases", INK), *((phase.name.lower(), phase_colour(phase)) for phase in seen)], 1.25)
        _draw_rate(rate, histories, end)
        _draw_trays(figure.add_axes((0.79, 0.065, 0.20, 0.74)), setup, histories, log)
        _draw_headline(figure, setup, summary)
        with replacing(path) as beside:
            figure.savefig(beside, dpi=200)


def _draw_belt(ax: Axes, setup: ConveyorSetup, histories: Sequence[PartHistory], log: Log, end: float) -> None:
    window, belt = setup.scenario.window, setup.scenario.belt
    ax.axhspan(window.y_first, window.y_last, color=_WINDOW, lw=0, zorder=0)
    for line, words in ((belt.entry, "entry"), (belt.end, "end of the belt")):
        ax.axhline(line, color=RULE, lw=1.0, zorder=1)
        ax.text(0.004, line, words, transform=ax.get_yaxis_transform(), fontsize=9.5, color=SOFT_INK, va="bottom")
    words = "picking window"
    ax.text(
        0.004, window.y_last - 0.01, words, transform=ax.get_yaxis_transform(), color=SOFT_INK, fontsize=9.5, va="top"
    )
    tool = log["tool"]
    ax.plot(tool.times, tool["y"], color=INK, lw=0.9, alpha=0.55, zorder=2)
    for part in histories:
        colour = FATE_COLOURS[part.fate]
        until = end if part.picked_at is None else part.picked_at
        y = part.xy[:, 1]
        riding = (part.times <= until) & (y >= belt.entry - _BESIDE) & (y <= belt.end + _BESIDE)
        if not riding.any():
            continue
        times, y = part.times[riding], y[riding]
        ax.plot(times, y, color=colour, lw=2.2, zorder=4)
        ax.text(times[0], y[0], f"{part.number} ", fontsize=8.5, color=colour, ha="right", va="bottom", zorder=4)
        if part.picked_at is not None:
            ax.plot(times[-1], y[-1], "o", color=colour, ms=7, mec="white", mew=0.8, zorder=6)
        if part.placed_at is not None:
            place = np.interp(part.placed_at, part.times, part.xy[:, 1])
            ax.plot(part.placed_at, place, "s", color=colour, ms=6, mec="white", mew=0.8, zorder=6)
    ax.set(xlim=(0.0, end), ylim=(min(belt.entry, -0.58) - _BESIDE, max(belt.end, 0.58) + _BESIDE))
    ax.set(ylabel="y  [m], along the belt")
    ax.set_title("Parts on the belt, and the hand", pad=27)
    ax.tick_params(labelbottom=False)
    name_colours(
        ax,
        (
            ("placed", HAND),
            ("held at the end", PREDICTED),
            ("missed", FAR_PREDICTED),
            ("dropped", DROPPED),
            ("on the belt", ON_BELT),
            ("hand", INK),
            ("●  picked", SOFT_INK),
            ("■  placed", SOFT_INK),
        ),
    )


def _draw_rate(ax: Axes, histories: Sequence[PartHistory], end: float) -> None:
    span = min(RATE_SPAN, end)
    times = np.linspace(0.0, end, 400)
    arrived = [part.arrival.time for part in histories if part.fate is not PartFate.UPSTREAM]
    picked = [part.picked_at for part in histories if part.picked_at is not None]
    for events, colour in ((arrived, ON_BELT), (picked, HAND)):
        ax.plot(times, rate_per_minute(np.array(events), times, span), color=colour, lw=2.0)
    ax.set(xlim=(0.0, end), xlabel="time  [s]", ylabel="1/min")
    ax.set_ylim(bottom=0.0)
    ax.grid(axis="y", color="#f0f1f3", lw=0.8)
    ax.set_axisbelow(True)
    ax.set_title(f"Parts a minute, over the last {span:.0f} s", pad=10)
    ax.text(1.0, 1.06, "arrived", transform=ax.transAxes, color=ON_BELT, weight="bold", fontsize=10.5, ha="right")
    ax.text(0.93, 1.06, "picked", transform=ax.transAxes, color=HAND, weight="bold", fontsize=10.5, ha="right")


def rate_per_minute(events: np.ndarray, times: np.ndarray, span: float) -> np.ndarray:
    """Returns how often something happened over the interval that ends at each time, shape (n,) [1/min].

    At the beginning, where less time has passed, the interval is shorter, but at least a quarter of its length.

    Args:
        events: times at which it happened [s], shape (m,).
        times: ends of the intervals [s], shape (n,).
        span: length of the intervals [s].
    """
    events = np.sort(events)
    count = np.searchsorted(events, times, "right") - np.searchsorted(events, times - span, "right")
    return 60.0 * count / np.clip(times, 0.25 * span, span)


def _draw_trays(ax: Axes, setup: ConveyorSetup, histories: Sequence[PartHistory], log: Log) -> None:
    belt, tray, states = setup.scenario.belt, setup.scenario.tray, log["truth_part_states"]
    low, high = belt.entry - _BESIDE, belt.end + _BESIDE
    ax.add_patch(Rectangle((belt.middle - 0.5 * belt.width, low), belt.width, high - low, fc=_BELT, lw=0, zorder=0))
    window = setup.scenario.window
    corner = (belt.middle - 0.5 * belt.width, window.y_first)
    ax.add_patch(Rectangle(corner, belt.width, window.y_last - window.y_first, fc="#d9e4da", lw=0, zorder=1))
    centres = cell_centres(tray)
    for x, y in centres:
        corner = (x - 0.5 * tray.cell, y - 0.5 * tray.cell)
        ax.add_patch(Rectangle(corner, tray.cell, tray.cell, fc="white", ec=_CELL, lw=1.0, zorder=1))
    for part in histories:
        k = part.number - 1
        x, y, qw, qx, qy, qz = states.view(*(f"{field}_{k}" for field in ("x", "y", "qw", "qx", "qy", "qz")))[-1]
        if not low <= y <= high:
            continue
        yaw = np.arctan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
        wrong = part.fate is PartFate.DROPPED or (part.placement is not None and part.placement.wrong)
        edge = FAR_PREDICTED if wrong else INK
        outline = placed_outline(part.arrival.kind, x, y, yaw)
        ax.add_patch(Polygon(outline, fc=part.arrival.colour, ec=edge, lw=2.0 if wrong else 0.8, zorder=3))
        ax.text(x, y, str(part.number), fontsize=7.5, color=INK, ha="center", va="center", zorder=4)
    ys = (min(low, centres[:, 1].min() - tray.pitch), max(high, centres[:, 1].max() + tray.pitch))
    ax.set(xlim=(centres[:, 0].min() - tray.pitch, belt.middle + 0.5 * belt.width + 0.02), ylim=ys)
    ax.set(xlabel="x  [m]")
    ax.set_aspect("equal", anchor="NW")
    ax.set_title("At the end; y  [m]", pad=27)


def _draw_headline(figure: Figure, setup: ConveyorSetup, summary: Mapping[str, Any]) -> None:
    headline = f"{summary['placed_of_these']} of {summary['could_be_picked']} parts that could be picked were placed"
    figure.text(0.045, 0.955, headline, fontsize=21, weight="bold", va="center")
    facts = [f"scenario {setup.scenario.name}, seed {setup.scenario.seed}"]
    facts += [f"{summary[name]} {name}" for name in ("arrived", "picked", "missed", "dropped", "misplaced")]
    if summary["picks_per_minute"] is not None:
        facts.append(f"{summary['picks_per_minute']:.1f} picks a minute")
    if summary["placement_rms_m"] is not None:
        facts.append(f"in the cells to {1e3 * summary['placement_rms_m']:.1f} mm rms")
    figure.text(0.045, 0.915, "   ·   ".join(facts), fontsize=11.5, color=SOFT_INK, va="center")
    reasons = [f"{count} {reason}" for reason, count in summary["missed_because"].items()]
    if reasons:
        words = f"Not picked: {', '.join(reasons)}"
        figure.text(0.045, 0.886, words, fontsize=11.5, color=FAR_PREDICTED, va="center")
