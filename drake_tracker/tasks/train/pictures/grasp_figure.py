"""The picture of a grasp: the camera images of the last half second before the jaws touched the train, the results of
vision, the expected place of the contact, and the hand.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import cv2
import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.episode import Log
from drake_tracker.tasks.filming import Frame
from drake_tracker.tasks.plots import name_colours
from drake_tracker.tasks.style import HAND, INK, PLOT_STYLE, SOFT_INK, phase_colour
from drake_tracker.tasks.train.closing import Contact, contact_of
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.pictures.grasp_instants import COUNT, GraspInstant, InstantView, grasp_instants
from drake_tracker.tasks.train.setup import TrainSetup

VISION, CONTACT, JAWS = "#ffb000", "#4cc2ff", "#37e0a6"
"""Colours of the results of vision, of the predicted contact and of the hand, on the images."""
_NAMES = (("predicted place of the contact", "#1480bd"), ("pads, by kinematics", HAND))
_VISION_NAME = "#b87a00"
"""Legend, in darker shades of the same colours."""
_WIDTH, _LEFT, _RIGHT, _GAP = 16.0, 0.45, 0.15, 0.08
_HEADER, _BETWEEN, _FOOTER = 1.62, 0.08, 0.15
"""Sizes of the picture and of its margins [inch]."""
_MARGIN = 28.0
"""Smallest distance from a mark to the border of a view [px of the camera]."""
_EDGE = (Stroke(linewidth=4.5, foreground="#0c0e10"), Normal())
"""A dark edge, which makes lines visible on any ground."""


def draw_grasp(
    setup: TrainSetup,
    cameras: Mapping[str, CameraModel],
    offsets: Mapping[str, tuple[int, int]],
    frames: Sequence[Frame],
    log: Log,
    path: Path,
) -> None:
    """Draws the instants before the contact of the last attempt side by side. Writes no file if the jaws never closed.

    Args:
        setup: the resolved scenario of the run.
        cameras: {side: calibrated camera}.
        offsets: {side: (u0, v0) of the first pixel of its images in the full image [px]}.
        frames: images around the last closing, in the order of time.
        log: {name: Signal} of the run.
        path: PNG file to write.
    """
    spans = phase_spans(log, setup.scenario.time_step)
    contact = contact_of(setup, log, spans)
    instants = grasp_instants(contact, spans, log, frames, cameras, offsets) if contact is not None else []
    if contact is not None and instants:
        with matplotlib.rc_context(PLOT_STYLE), replacing(path) as beside:
            grasp_figure(setup, contact, instants).savefig(beside, dpi=150)


def grasp_figure(setup: TrainSetup, contact: Contact, instants: Sequence[GraspInstant]) -> Figure:
    """Returns the picture of a grasp: a row of views for each camera, a column for each instant.

    Each view shows the same part of its camera's image, in pixel coordinates of the full image.

    Args:
        setup: the resolved scenario of the run.
        contact: when the jaws touched the train.
        instants: at least one, in the order of time.
    """
    sides = tuple(instants[0].sights)
    cell = (_WIDTH - _LEFT - _RIGHT - (COUNT - 1) * _GAP) / COUNT
    height = _HEADER + len(sides) * cell + (len(sides) - 1) * _BETWEEN + _FOOTER
    figure = Figure(figsize=(_WIDTH, height), facecolor="white")
    FigureCanvasAgg(figure)
    for row, side in enumerate(sides):
        view = common_view([instant.sights[side] for instant in instants])
        for column, instant in enumerate(instants):
            left = _LEFT + column * (cell + _GAP)
            bottom = height - _HEADER - (row + 1) * cell - row * _BETWEEN
            ax = figure.add_axes((left / _WIDTH, bottom / height, cell / _WIDTH, cell / height))
            _draw_sight(ax, instant.sights[side], view, instant.seen)
            if row == 0:
                _caption(ax, instant)
            if column == 0:
                ax.set_ylabel(f"camera {side}", labelpad=6, fontsize=11.5)
    _draw_header(figure, setup, contact, height, cell)
    return figure


def common_view(sights: Iterable[InstantView]) -> tuple[float, float, float, float]:
    """Returns the square (left, right, bottom, top) [px] of a camera's image that shows what happens near the object.

    It contains the positions of the object in all sights. The hand, which comes from above, need not be in it.

    Args:
        sights: of one camera.
    """
    marks = np.concatenate([np.vstack([sight.point, sight.contact, sight.outline]) for sight in sights])
    marks = marks[np.isfinite(marks).all(axis=1)]
    if not len(marks):
        marks = np.concatenate([sight.jaws for sight in sights])
    low, high = marks.min(axis=0), marks.max(axis=0)
    u, v = 0.5 * (low + high)
    half = 0.5 * float(np.max(high - low)) + _MARGIN
    return u - half, u + half, v + half, v - half


def _draw_sight(ax: Axes, sight: InstantView, view: tuple[float, float, float, float], seen: bool) -> None:
    """Draws a part of an image with its marks."""
    (u0, v0), (height, width, _) = sight.offset, sight.image.shape
    extent = (u0 - 0.5, u0 + width - 0.5, v0 + height - 0.5, v0 - 0.5)
    ax.imshow(cv2.cvtColor(sight.image, cv2.COLOR_BGR2RGB), extent=extent, interpolation="bicubic")
    if len(sight.outline):
        ax.plot(*np.vstack([sight.outline, sight.outline[:1]]).T, color=VISION, lw=1.6, gid="outline")
    face = VISION if seen else "none"
    ax.plot(*sight.point, "o", ms=7, mfc=face, mec=VISION, mew=1.6, path_effects=_EDGE, gid="point")
    ax.plot(*sight.jaws.T, color=JAWS, lw=2.0, marker="|", ms=13, mew=2.4, path_effects=_EDGE, gid="jaws")
    ax.plot(*sight.contact, "+", color=CONTACT, ms=17, mew=2.4, path_effects=_EDGE, gid="contact")
    ax.set(xlim=view[:2], ylim=view[2:], xticks=[], yticks=[], facecolor="#15181c")
    ax.spines[:].set_visible(False)


def _caption(ax: Axes, instant: GraspInstant) -> None:
    """Writes the time and the arm's knowledge above a view."""
    when = f"{abs(instant.before):.2f} s {'after' if instant.before < -0.005 else 'to'} contact"
    age = f"newest measurement {instant.age:.2f} s old" if np.isfinite(instant.age) else "no packet"
    lines = [
        (when, 13, "bold", INK),
        (instant.phase.name.lower(), 10.5, "bold", phase_colour(instant.phase)),
        (age, 9, "normal", SOFT_INK),
    ]
    for (words, size, weight, colour), y in zip(lines, (1.17, 1.095, 1.03)):
        ax.text(0.0, y, words, transform=ax.transAxes, fontsize=size, weight=weight, color=colour)


def _draw_header(figure: Figure, setup: TrainSetup, contact: Contact, height: float, cell: float) -> None:
    """Writes the title, the facts about the run and, beginning at the middle column, the legend."""
    guided = setup.grasp.descent == "guided"
    way = "guided by vision" if guided else "blind since the launch"
    what = "contact" if contact.made else "no contact: the pads would have touched"
    facts = f"scenario {setup.scenario.name}, seed {setup.scenario.seed}   ·   {what} at {contact.time:.2f} s"
    facts += f"   ·   vision is {setup.scenario.vision.lag_cycles * VISION_PERIOD:.2f} s late"
    top, left = 1.0 - 0.30 / height, _LEFT / _WIDTH
    figure.text(left, top, f"The last half second before the contact, {way}", fontsize=21, weight="bold", va="center")
    figure.text(left, 1.0 - 0.67 / height, facts, fontsize=11.5, color=SOFT_INK, va="center")
    middle = (_LEFT + 0.5 * COUNT * (cell + _GAP)) / _WIDTH
    ax = figure.add_axes((middle, 1.0 - 0.74 / height, 1.0 - middle, 0.2 / height), frameon=False, xticks=[], yticks=[])
    found = "outline and position by vision" if setup.several else "centroid by vision"
    name_colours(ax, [(found if guided else f"{found}, not used", _VISION_NAME), *_NAMES], y=0.0)
