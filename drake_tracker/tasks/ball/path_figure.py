"""The picture of a run of the ball: its path down the board and into the cup, and the predictions."""

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Rectangle

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.messages import Prediction, predicted_points
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.tasks.ball.setup import BallSetup
from drake_tracker.tasks.ball.summary import HALF_CUP, last_verdict, over_the_cup
from drake_tracker.tasks.episode import Log, fresh_packets, phase_spans
from drake_tracker.tasks.plots import broken, draw_phases, name_colours, name_limit
from drake_tracker.tasks.style import (
    FAR_PREDICTED,
    FILTERED,
    HAND,
    INK,
    PLOT_STYLE,
    RULE,
    SEEN,
    SOFT_INK,
    TRUTH,
)
from drake_tracker.world.ball.ball_board import BALL_RADIUS, CIRCLE_RADIUS, CIRCLES, PEG_RADIUS, TOUCH_MARKS
from drake_tracker.world.ball.ball_board_visual import WALL_THICKNESS
from drake_tracker.world.ball.ball_fixtures import GATE_SIZE
from drake_tracker.world.ball.catch_judge_system import BOWL_LOWER, BOWL_UPPER
from drake_tracker.world.config import BoardConfig

FACE, WOOD = "#f7f6f2", "#a9794a"
"""Colours of the board's face and of the pegs."""
STROBE = 0.25
"""Time between two drawings of the ball on its path [s]."""
WARM = LinearSegmentedColormap.from_list("warm", ["#7a2b00", FAR_PREDICTED, "#e69f00", "#f7dfa5"])
"""Colours of predictions: dark shortly before the crossing, pale long before."""
LONG_BEFORE = 1.5
"""Time before the crossing at which the colour is palest [s]."""
BEFORE, AFTER = 0.35, 1.1
"""Time shown before the release and after the crossing [s]."""


class RunOfTheBall:
    """A run of the ball, as its picture needs it.

    Args:
        hand_eye: the diagram of the run.
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        log: {name: Signal} of the run.
        laboratory: the true laboratory.
        X_BW: pose of the world in the true frame of the board.
        half_width: half the width of the board [m].
        spans: phases of the run.
        verdict: the last findings of the judge, a `CatchVerdict`.
        released: time of the release [s], or None.
        crossing: time at which the ball crossed the bottom edge [s], or None.
        over_the_cup: x_B at which the ball passes over the cup [m], or None.
        shown: start and end of the time axes [s].
        packets: all packets that predict a crossing.
        times: times at which these packets arrived [s], shape (n,).
        predicted: predicted crossings of the packets: x_B [m], time [s], standard deviation [m]; shape (n, 3).
    """

    def __init__(self, hand_eye: HandEyeDiagram, setup: BallSetup, log: Log) -> None:
        self.log, self.laboratory = log, hand_eye.world.laboratory
        self.X_BW, self.half_width = self.laboratory.X_WB.inverse(), 0.5 * setup.scenario.board.width
        self.spans = phase_spans(log, CatchPhase, setup.scenario.time_step)
        self.verdict = last_verdict(log)
        self.released = float(self.verdict.released) or None
        self.crossing = float(self.verdict.crossing_time) or None
        self.over_the_cup = over_the_cup(hand_eye, setup, log, self.verdict) if self.crossing else None
        end = self.spans[-1].end if self.spans else 0.1
        start = max(self.released - BEFORE, 0.0) if self.released else 0.0
        self.shown = (start, max(min(end, self.crossing + AFTER) if self.crossing else end, start + 0.1))
        delivered, edge = log["delivered"], setup.edge
        packets, times, predicted = [], [], []
        for k in fresh_packets(delivered):
            crossing = edge.crossing(delivered.data[k])
            if crossing is not None and crossing.time > delivered.times[k]:
                x, _, _ = self.X_BW @ crossing.p_WQ
                packets.append(delivered.data[k])
                times.append(delivered.times[k])
                predicted.append((x, crossing.time, crossing.std))
        self.packets, self.times, self.predicted = packets, np.array(times), np.reshape(predicted, (-1, 3))

    def on_board(self, p_WQ: np.ndarray) -> np.ndarray:
        """Returns points in the frame of the board [m], shape (n, 3), from points in W [m]."""
        return (self.X_BW @ np.reshape(p_WQ, (-1, 3)).T).T

    def ball(self, times: np.ndarray) -> np.ndarray:
        """Returns the true (x, y)_B of the ball [m], shape (n, 2), at given times [s], shape (n,)."""
        truth = self.log["truth_ball_state"]
        if len(truth.times) == 0:
            return np.full((len(times), 2), np.nan)
        return self.on_board(np.column_stack([np.interp(times, truth.times, truth[axis]) for axis in "xyz"]))[:, :2]

    @property
    def colours(self) -> np.ndarray:
        """Colours of the packets, by the time from their arrival to the predicted crossing, shape (n, 4)."""
        return WARM(Normalize(0.0, LONG_BEFORE)(self.predicted[:, 1] - self.times))

    @property
    def end_of_roll(self) -> float:
        """Time of the crossing, or the end of the time axes when there was none [s]."""
        return self.crossing or self.shown[1]


def draw_ball_path(
    hand_eye: HandEyeDiagram, setup: BallSetup, log: Log, summary: Mapping[str, Any], path: Path
) -> None:
    """Draws a run as one picture, 3200 x 1800 px: the board from above, the predictions, and the path of the hand.

    Args:
        hand_eye: the diagram of the run, with the attribute ``poses`` and the ground truth of its world.
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        summary: the return value of `summarise_ball`.
        path: PNG file to write.
    """
    run = RunOfTheBall(hand_eye, setup, log)
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        FigureCanvasAgg(figure)
        _draw_board(figure.add_axes((0.045, 0.065, 0.335, 0.755)), run, setup)
        places = ((0.835, 0.025), (0.505, 0.215), (0.285, 0.140), (0.065, 0.140))
        strip, across, errors, left = (figure.add_axes((0.41, low, 0.565, height)) for low, height in places)
        draw_phases(strip, run.spans, *run.shown)
        _draw_across(across, run)
        _draw_errors(errors, run)
        _draw_time_left(left, run)
        _draw_headline(figure, setup, summary)
        with replacing(path) as beside:
            figure.savefig(beside, dpi=200)


def _draw_board(ax: Axes, run: RunOfTheBall, setup: BallSetup) -> None:
    board = setup.scenario.board
    _draw_furniture(ax, board, run)
    for packet, colour, (_, time, _) in zip(run.packets, run.colours, run.predicted):
        ahead = predicted_points(packet, np.linspace(Prediction(packet).stamp, time, 40))
        ax.plot(*run.on_board(ahead)[:, :2].T, color=colour, lw=1.1, alpha=0.75, zorder=3)
    ax.scatter(run.predicted[:, 0], np.zeros(len(run.predicted)), s=26, c=run.colours, ec="white", lw=0.5, zorder=8)

    truth, point, filtered = (run.log[name] for name in ("truth_ball_state", "point", "filtered"))
    rolls = (truth.times >= (run.released or np.inf)) & (truth.times <= run.end_of_roll + 0.25)
    path = run.ball(truth.times)
    ax.plot(*path[rolls].T, color=TRUTH, lw=1.5, zorder=5)
    if run.released:
        for time in np.arange(run.released, run.end_of_roll, STROBE):
            _ball(ax, run.ball(np.array([time]))[0], 0.9, zorder=4)
    elif len(path):
        _ball(ax, path[0], 1.0, zorder=4)
    rolling = (point["stamp"] > 0.0) & (point["stamp"] <= run.end_of_roll)
    seen = rolling & (point["valid"] > 0)
    places = run.on_board(point.view("x", "y", "z")[seen])
    ax.plot(*places[:, :2].T, "o", color=SEEN, ms=3.6, mec="white", mew=0.4, zorder=7)
    kept = (filtered["valid"] > 0) & (filtered["stamp"] <= run.end_of_roll)
    places = run.on_board(filtered.view("x", "y", "z")[kept])
    ax.plot(*broken(filtered["stamp"][kept], *places[:, :2].T), color=FILTERED, lw=1.9, zorder=6)

    tool = run.log["tool"]
    hand = run.on_board(tool.view("x", "y", "z"))[:, :2]
    moving = (tool.times >= run.shown[0]) & (tool.times <= run.end_of_roll + 0.3)
    if moving.any():
        first, last = hand[moving][0], hand[moving][-1]
        _cup(ax, first, ls=(0, (3, 3)), alpha=0.6)
        _cup(ax, last, fc="#e3f3ee")
        ax.plot(*hand[moving].T, color=HAND, lw=2.2, zorder=9)
        if run.verdict.caught:
            _ball(ax, path[-1], 1.0, zorder=10)
            ax.annotate("caught", last - [0.0, 0.058], color=HAND, weight="bold", ha="center", va="top")
    half = 0.5 * board.width + 0.035
    ax.set(xlim=(-half, half), ylim=(-0.155, board.length + 0.02))
    ax.set(xlabel="x  [m], across", ylabel="y  [m], up the slope")
    ax.set_aspect("equal", anchor="W")
    ax.set_title("The board from above", pad=27)
    names = (("ball", TRUTH), ("measured", SEEN), ("filtered", FILTERED), ("predicted", FAR_PREDICTED), ("cup", HAND))
    ax.figure.draw_without_rendering()  # fixes the width of the axes, which depends on the shape of the board
    name_colours(ax, names)


def _draw_furniture(ax: Axes, board: BoardConfig, run: RunOfTheBall) -> None:
    half = 0.5 * board.width
    ax.add_patch(Rectangle((-half, 0.0), board.width, board.length, fc=FACE, ec="#d9d6cc", lw=1.0, zorder=0))
    if board.walls:
        for x in (-half - WALL_THICKNESS, half):
            ax.add_patch(Rectangle((x, 0.0), WALL_THICKNESS, board.length, fc="#d9d6cc", lw=0, zorder=1))
    for centre in CIRCLES:
        ax.add_patch(Circle(centre, CIRCLE_RADIUS, fc="#2a2d31", lw=0, zorder=1))
    ax.plot(*np.transpose(TOUCH_MARKS), "+", color="#2a2d31", ms=8, mew=1.3, zorder=1)
    start = run.ball(run.log["truth_ball_state"].times[:1])
    for x, y in start:
        gate = (x - 0.5 * GATE_SIZE[0], y - BALL_RADIUS - GATE_SIZE[1])
        ax.add_patch(Rectangle(gate, *GATE_SIZE[:2], fc="#b9b6ab", lw=0, zorder=1))
    for peg in run.laboratory.pegs:
        ax.add_patch(Circle(peg, PEG_RADIUS, fc=WOOD, ec="#7d5a37", lw=0.8, zorder=2))


def _ball(ax: Axes, place: np.ndarray, strength: float, zorder: float) -> None:
    ax.add_patch(Circle(place, BALL_RADIUS, fc="white", ec=INK, lw=0.9, alpha=strength, zorder=zorder))


def _cup(ax: Axes, place: np.ndarray, **look: Any) -> None:
    """Draws the inside of the bowl, projected onto the board: x_T is parallel to y_B."""
    depth, width = (BOWL_UPPER[k] - BOWL_LOWER[k] for k in (0, 1))
    corner = np.subtract(place, (0.5 * width, 0.5 * depth))
    style = {"fc": "none", "ec": HAND, "lw": 1.6, "zorder": 2, **look}
    ax.add_patch(FancyBboxPatch(corner, width, depth, boxstyle="round,pad=0,rounding_size=0.012", **style))


def _draw_across(ax: Axes, run: RunOfTheBall) -> None:
    tool = run.log["tool"]
    hand = 1e3 * run.on_board(tool.view("x", "y", "z"))[:, 0]
    if run.released:
        times = np.linspace(run.released, run.end_of_roll, 400)
        ax.plot(times, 1e3 * run.ball(times)[:, 0], color=TRUTH, lw=1.0, alpha=0.55, zorder=2)
    x, std = 1e3 * run.predicted[:, 0], 1e3 * run.predicted[:, 2]
    gapped = broken(run.times, run.times, x - std, x + std) if len(x) else ([], [], [])
    ax.fill_between(*gapped, color="#e69f00", alpha=0.22, lw=0, zorder=1)
    ax.scatter(run.times, x, s=30, c=run.colours, ec="white", lw=0.5, zorder=4)
    ax.plot(tool.times, hand, color=HAND, lw=2.2, zorder=3)
    if run.crossing:
        ax.axhline(1e3 * run.verdict.crossing_x, color=TRUTH, lw=1.0, ls=(0, (4, 3)), zorder=1)
        ax.plot(run.crossing, 1e3 * run.verdict.crossing_x, "o", ms=8, mfc="white", mec=TRUTH, mew=1.6, zorder=5)
    ax.set_ylim(-1e3 * run.half_width, 1e3 * run.half_width)
    _time_axis(ax, run, "Crossing of the edge, and the cup", "across  [mm]")
    name_colours(ax, (("ball", TRUTH), ("predicted, with std", FAR_PREDICTED), ("cup", HAND)))
    bar = ax.inset_axes((0.77, 1.11, 0.23, 0.05))
    bar.imshow(np.linspace(0.0, 1.0, 128)[None], cmap=WARM, aspect="auto", extent=(0.0, LONG_BEFORE, 0.0, 1.0))
    bar.set(yticks=[], xticks=(0.0, 0.5, 1.0, 1.5))
    bar.tick_params(labelsize=9, length=2, pad=1)
    bar.invert_xaxis()
    bar.spines[:].set_visible(False)
    bar.set_title("time before the crossing  [s]", fontsize=9.5, weight="normal", color=SOFT_INK, pad=3, loc="right")


def _draw_errors(ax: Axes, run: RunOfTheBall) -> None:
    fits = 1e3 * HALF_CUP
    if run.crossing:
        tool = run.log["tool"]
        near = (tool.times > run.crossing - LONG_BEFORE) & (tool.times < run.crossing + 0.25)
        hand = run.on_board(tool.view("x", "y", "z"))[:, 0] - run.over_the_cup
        ax.plot(tool.times[near], 1e3 * hand[near], color=HAND, lw=2.2, zorder=3)
        error = 1e3 * (run.predicted[:, 0] - run.verdict.crossing_x)
        ax.scatter(run.times, error, s=30, c=run.colours, ec="white", lw=0.5, zorder=4)
    for side in (-fits, fits):
        ax.axhline(side, color=SOFT_INK, lw=0.9, ls=(0, (4, 3)), zorder=0)
    ax.axhline(0.0, color=RULE, lw=0.8, zorder=0)
    ax.set_ylim(-2.4 * fits, 2.4 * fits)
    name_limit(ax, f"clear of the rim: {fits:.0f} mm", fits)
    _time_axis(ax, run, "Error relative to the true crossing", "error  [mm]", pad=10)


def _draw_time_left(ax: Axes, run: RunOfTheBall) -> None:
    left = run.predicted[:, 1] - run.times
    longest = max([LONG_BEFORE, *left])
    ax.scatter(run.times, left, s=30, c=run.colours, ec="white", lw=0.5, zorder=4)
    if run.released and run.crossing:
        ax.plot([run.released, run.crossing], [run.crossing - run.released, 0.0], color=TRUTH, lw=1.2, zorder=2)
        longest = max(longest, run.crossing - run.released)
    ax.set_ylim(0.0, 1.05 * longest)
    _time_axis(ax, run, "Time left until the crossing", "s", pad=10)
    ax.tick_params(labelbottom=True)
    ax.set_xlabel("time  [s]")


def _time_axis(ax: Axes, run: RunOfTheBall, title: str, label: str, pad: float = 27) -> None:
    ax.set(xlim=run.shown, ylabel=label)
    ax.set_title(title, pad=pad)
    ax.tick_params(labelbottom=False)
    ax.grid(axis="y", color="#f0f1f3", lw=0.8)
    ax.set_axisbelow(True)
    for time in (run.released, run.crossing):
        if time:
            ax.axvline(time, color=RULE, lw=1.0, zorder=0)


def _draw_headline(figure: Figure, setup: BallSetup, summary: Mapping[str, Any]) -> None:
    headline = "Ball not caught"
    if summary["success"]:
        headline = (
            f"Ball caught, {1e3 * abs(summary['hand_error_m']):.0f} mm from the middle of the cup at the crossing"
        )
    title = figure.text(0.045, 0.955, headline, fontsize=21, weight="bold", va="center")
    if summary["failure_reason"]:
        end = title.get_window_extent(figure.canvas.get_renderer()).x1 / figure.bbox.width
        reason = textwrap.fill(summary["failure_reason"], 118)
        figure.text(end + 0.015, 0.954, reason, fontsize=11.5, color=FAR_PREDICTED, va="center")
    facts = [f"scenario {setup.scenario.name}, seed {setup.scenario.seed}"]
    for key, words, scale in (
        ("roll_s", "rolled {:.2f} s", 1.0),
        ("exit_speed_m_s", "left the board at {:.2f} m/s", 1.0),
        ("position_rms_m", "measured to {:.1f} mm rms", 1e3),
    ):
        if summary[key] is not None:
            facts.append(words.format(scale * summary[key]))
    figure.text(0.045, 0.915, "   ·   ".join(facts), fontsize=11.5, color=SOFT_INK, va="center")
