"""The strips of a live track: how fast the object moves, and how well the cameras and the prediction agree."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from drake_tracker.own_cameras.table import HORIZON
from drake_tracker.tasks.strips import Strip, rounded

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
