"""The live view of a track: the page of a run, with the images, objects and strips of your own cameras."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drake_tracker.live.control import RATES
from drake_tracker.live.view import LiveView
from drake_tracker.own_cameras.overlay import COLOURS, OTHER, TrackOverlay
from drake_tracker.own_cameras.preparation import PreparedTrack
from drake_tracker.own_cameras.table import HORIZON
from drake_tracker.tasks.strips import Strip, rounded
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.image_tracker import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.track_2d import TrackState2D

LEGEND: tuple[tuple[str, str], ...] = (
    ("path", "predicted path"),
    ("energy", "moving pixels"),
    ("centroid", "their centroid"),
)
"""Marks in the images, see `Frames.open`."""
LEGEND_OF_SEVERAL = (("path", "predicted path, in the colour of its object"), *LEGEND[1:])
STATE_COLOURS = {
    TrackState2D.LOST: "#9aa1ab",
    TrackState2D.MOVING: "#56b4e9",
    TrackState2D.STANDING: "#009e73",
    TrackState2D.HIDDEN: "#e69f00",
}
_NOTES = (
    "The prediction error is measured by the camera itself: there is no ground truth.",
    "Gap and prediction error are measured by the cameras themselves: there is no ground truth.",
)
"""Captions of the strips, for one camera and for two cameras."""
IN_STRIPS = "target, in the strips"
"""Caption in the table for the object that state and strips describe, if there are several targets."""
SPAN = 20.0
"""Time in view [s]."""
_POINT_STRIPS = (
    Strip("Speed", "of the filtered point", "m/s", None, 3),
    Strip("Gap", "between the rays of both cameras", "mm", None, 2),
    Strip("Prediction error", f"{HORIZON:g} s ahead, to the point measured then", "mm", None, 1),
)
_PIXEL_STRIPS = (
    Strip("Speed", "of the filtered point in the image", "px/s", None, 0),
    Strip("Prediction error", f"{HORIZON:g} s ahead, to the pixel measured then", "px", None, 1),
)


@dataclass(frozen=True)
class TrackPage:
    """Description of the frames of a `TrackOverlay` for the live view, in place of a `VideoPage`.

    Attributes:
        panels: (side, late, place) of each camera.
        lag: age of the images [s].
        legend: marks in the images.
        caption: of each panel.
        goal: there is none.
        several: whether objects are listed.
    """

    panels: list[tuple[str, bool, tuple[int, int, int, int]]]
    lag: float
    legend: tuple[tuple[str, str], ...]
    caption: str
    goal: None = None
    several: bool = True

    def draw(self, page: np.ndarray, _: None) -> np.ndarray:
        """Returns a frame as it is: the overlay has drawn it."""
        return page


class TrackView(LiveView):
    """The page of a track. A recording can be paused; a live camera cannot.

    Args:
        port: port to listen at; 0 takes a free one. Raises DrakeTrackerError when the port is taken.
        say: prints a line.
    """

    def __init__(self, port: int, say: Callable[[str], object]) -> None:
        super().__init__(port, say)
        self._live = False
        self._rows: list[dict[str, Any]] = []
        self._strips: TrackStrips | None = None
        self._state = int(TrackState2D.LOST)

    def introduce_track(self, track: PreparedTrack) -> None:
        """Shows the sources of the track on the page."""
        live = track.footage[0].live
        self._live = live
        kinds = ", ".join(track.facts[part]["kind"] for part in ("detector", "estimator"))
        self.state.set_facts(
            title=" and ".join(each.name for each in track.footage),
            subtitle=f"{1.0 / track.timeline.period:.3g} images/s, {kinds}",
            duration=None if track.timeline.count is None else track.timeline.duration,
            rates=None if live else RATES,
            scene=None,
            clock="s tracked",
            note=_NOTES[len(track.footage) - 1],
            controls=not live,
            unit="px",
            ribbon="State",
            operator=False,
        )

    def watch_track(self, track: PreparedTrack, overlay: TrackOverlay, columns: Sequence[str]) -> None:
        """Describes images and strips to the page, and begins.

        Args:
            track: the track.
            overlay: draws the frames.
            columns: of its table.
        """
        self._strips = TrackStrips(columns, track.timeline.period, track.footage[0].size)
        age = track.age_cycles * track.timeline.period
        sides = [(side if len(track.footage) > 1 else "", True) for side in track.diagram.sides]
        panels = [(*side, place) for side, place in zip(sides, overlay.panels())]
        several = track.diagram.places > 1
        legend = LEGEND_OF_SEVERAL if several else LEGEND
        self.frames.open(TrackPage(panels, age, legend, f"what was detected, {age:.2f} s before the newest image"))
        self.state.set_facts(
            phases=[{"name": state.name.capitalize(), "colour": STATE_COLOURS[state]} for state in TrackState2D],
            strips=[asdict(strip) for strip in self._strips.strips],
            span=SPAN,
        )
        self.begin()

    def show(
        self,
        now: float,
        row: Sequence[float] | None,
        objects: Sequence[ImageObjects | None],
        interrupted: Callable[[], bool],
    ) -> None:
        """Updates the page with one cycle, and holds a recording while the page requests it.

        Args:
            now: time of the cycle [s].
            row: new row of the table, None when there is none.
            objects: of each camera in the image that the row describes.
            interrupted: returns whether the track was interrupted.
        """
        if row is not None and self._strips is not None:
            self._state = int(row[-1])
            self._rows = _list_objects(objects)
            self.state.add_sample((round(row[0], 4), self._state, *self._strips.values(row)))
        self.look(now, self._state, None, interrupted)

    def _tracks(self) -> tuple[list[dict[str, Any]], str]:
        return self._rows, ""

    def _act(self, action: Any, values: dict[str, Any]) -> dict[str, Any]:
        if self._live or action not in ("pause", "resume", "step", "rate"):
            raise ValueError("there is no such action")
        return super()._act(action, values)


def _list_objects(objects: Sequence[ImageObjects | None]) -> list[dict[str, Any]]:
    """Returns the objects in the first camera's image for JSON, see `Frames.tracks`; speeds [px/s] and sizes [px].

    If several objects are tracked, objects without a partner in the second image are omitted. State and strips describe
    the first target; with several targets, ``words`` name it.
    """
    known = objects[0] if objects else None
    if known is None:
        return []
    return [
        {
            "number": track.number,
            "target": track.number in known.targets,
            "words": IN_STRIPS if len(known.targets) > 1 and track.number == known.targets[0] else None,
            "state": track.state.name.lower(),
            "seen": track.seen >= track.stamp,
            "speed": round(track.speed, 1),
            "size": round(track.size, 1),
            "colour": COLOURS[track.number % len(COLOURS)] if track.number in known.targets else OTHER,
            "at": [],
        }
        for track in known.tracks
        if track.hits >= CONFIRM_AFTER and track.number > 0
    ]


class TrackStrips:
    """Computes the values of the strips from the rows of a `TrackTable`.

    Attributes:
        strips: the strips from top to bottom; in pixels without calibration.
    """

    def __init__(self, columns: Sequence[str], period: float, size: tuple[int, int]) -> None:
        """Begins without a row.

        Args:
            columns: of the table.
            period: of the images [s].
            size: (width, height) of the images of the first camera [px].
        """
        self._columns, self._period = tuple(columns), period
        self._before: tuple[float, np.ndarray] | None = None
        self._predicted: deque[tuple[float, np.ndarray]] = deque()
        self._number = np.nan
        self._axes = "xyz" if "x" in columns else "uv"
        if self._axes == "uv":
            self.strips: tuple[Strip, ...] = (
                *_PIXEL_STRIPS,
                Strip("u", "from the left edge of the image", "px", float(size[0]), 1),
                Strip("v", "from the upper edge of the image", "px", float(size[1]), 1),
            )
        else:
            both = "right_u" in columns
            self.strips = tuple(strip for strip in _POINT_STRIPS if both or strip.title != "Gap")

    def values(self, row: Sequence[float]) -> list[float | None]:
        """Returns the value of each strip, None where it is unknown.

        Speed and prediction error need earlier rows of the same object.

        Args:
            row: newest row of the table.
        """
        value = dict(zip(self._columns, row))
        self._begin_again_with(value["id"])
        stamp, factor = value["stamp"], 1.0 if self._axes == "uv" else 1e3
        speed = self._speed(stamp, np.array([value[f"filtered_{axis}"] for axis in self._axes]))
        error = self._error(stamp, np.array([value[axis] for axis in self._axes]))
        ahead = np.array([value[f"predicted_{axis}"] for axis in self._axes])
        if np.isfinite(ahead).all():
            self._predicted.append((stamp + HORIZON, ahead))
        values = {"Speed": speed, "Prediction error": factor * error}
        values |= {"Gap": 1e3 * value["gap"]} if "gap" in value else {axis: value[axis] for axis in self._axes}
        return rounded([values[strip.title] for strip in self.strips])

    def _begin_again_with(self, number: float) -> None:
        """Forgets the rows of another object. A row without an object, whose number is NaN, changes nothing."""
        if number != self._number and np.isfinite(number):
            if np.isfinite(self._number):
                self._before = None
                self._predicted.clear()
            self._number = number

    def _speed(self, stamp: float, place: np.ndarray) -> float:
        """Returns the speed since the row before, NaN where one of the two places is unknown."""
        before, self._before = self._before, (stamp, place)
        if before is None:
            return np.nan
        return float(np.linalg.norm(place - before[1]) / (stamp - before[0]))

    def _error(self, stamp: float, measured: np.ndarray) -> float:
        """Returns the distance from the point that was predicted for this stamp, NaN without a prediction."""
        while self._predicted and self._predicted[0][0] < stamp - 0.5 * self._period:
            self._predicted.popleft()
        if not self._predicted or self._predicted[0][0] > stamp + 0.5 * self._period:
            return np.nan
        return float(np.linalg.norm(measured - self._predicted[0][1]))
