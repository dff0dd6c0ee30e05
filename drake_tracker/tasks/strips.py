"""Strips of the live view, small charts of errors over time: their description, and the arithmetic for all tasks.

Errors are measured against the simulator's ground truth, which the tracking loop never sees. The strips of each
task are in `strips.py` of its package.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drake_tracker.core.messages import Frozen, Prediction, evaluate_prediction

FAINT, BRIGHT = "faint", "bright"
"""Line styles: faint for measured or commanded values, bright for the values that result from them."""
OLDEST_POINT = 0.6
"""Greatest age of a point for which the arc length is shown [s]: a little more than twice the lag of vision."""


@dataclass(frozen=True)
class Strip:
    """One strip of the page.

    Attributes:
        title: name of the strip.
        meaning: what it shows, in a few words.
        unit: unit of its values.
        top: upper end of its scale; None follows the values in view. The lower end is 0.
        decimals: number of decimals with which the newest value is shown.
        lines: (name, `FAINT` or `BRIGHT`) of each line.
    """

    title: str
    meaning: str
    unit: str
    top: float | None
    decimals: int = 1
    lines: tuple[tuple[str, str], ...] = (("", BRIGHT),)


class StripInputs(NamedTuple):
    """Values of a run at one instant, from which the strips are computed.

    Attributes:
        now: simulated time [s].
        p_WT: position of the tool in W [m], shape (3,).
        p_WQ: true position of the object in W [m], shape (3,); of the first one where there are several.
        packet: vector of the newest `Prediction` that the arm accepted.
        filtered: a `Filtered` message; all zeros where the host has none.
        command: an `ArmCommand` message.
        points: the two newest valid `TrackPoint` messages, older first, or fewer.
        report: a message of the task, see `StripChart.report_view`.
        states: true states of all objects, as free bodies, shape (n, 13).
    """

    now: float
    p_WT: np.ndarray
    p_WQ: np.ndarray
    packet: np.ndarray
    filtered: Any
    command: Any
    points: tuple[Any, ...]
    report: Any
    states: np.ndarray


@dataclass(frozen=True)
class StripChart:
    """The strips of a task, and where their values come from.

    Attributes:
        strips: the strips from top to bottom.
        span: simulated time shown [s].
        values: function that returns one value for each line of all strips, None for an unknown value.
        state_port: output port of the diagram with the true state of the object, or of several objects, 13 elements
            each (quaternion, position, angular and translational velocity).
        report_port: output port of the diagram with a message of the task.
        report_view: named view of that message.
    """

    strips: tuple[Strip, ...]
    span: float
    values: Callable[[StripInputs], list[float | None]]
    state_port: str
    report_port: str
    report_view: Any


PREDICTION_STRIP = Strip("Prediction error", "predicted to true present position", "mm", 30.0)
"""The strip of `prediction_error`, the same for every task."""


def prediction_error(inputs: StripInputs) -> float | None:
    """Returns the horizontal distance from the predicted present position of the object to the true one [mm].

    None while there is no valid packet, or while the arm is blind and follows an older packet.
    """
    if inputs.command.frozen == Frozen.BLIND or not Prediction(inputs.packet).valid:
        return None
    return horizontal_distance(evaluate_prediction(inputs.packet, inputs.now), inputs.p_WQ)


def arc_lengths(inputs: StripInputs) -> tuple[float | None, float | None]:
    """Returns the arc length between the two newest points [mm]: (measured, filtered).

    Both are None while there are fewer than two points, or when the newest is older than `OLDEST_POINT`. The filtered
    arc length is None while the filter has no valid state.
    """
    if len(inputs.points) < 2 or inputs.now - inputs.points[-1].stamp > OLDEST_POINT:
        return None, None
    earlier, later = inputs.points
    measured = float(np.linalg.norm([later.x - earlier.x, later.y - earlier.y, later.z - earlier.z]))
    time = later.stamp - earlier.stamp
    return 1e3 * measured, 1e3 * inputs.filtered.speed * time if inputs.filtered.valid else None


def horizontal_distance(first: Sequence[float] | np.ndarray, second: Sequence[float] | np.ndarray) -> float:
    """Returns the horizontal distance between two positions [mm].

    Args:
        first: a position (x, y, ...) [m].
        second: another position (x, y, ...) [m].
    """
    return 1e3 * float(np.hypot(first[0] - second[0], first[1] - second[1]))


def rounded(values: Iterable[float | None]) -> list[float | None]:
    """Returns values rounded to three decimals. A value that is None or not finite becomes None."""
    return [round(float(value), 3) if value is not None and np.isfinite(value) else None for value in values]


@dataclass(frozen=True)
class Overview:
    """The live page's view from above, and the sources of its content.

    Attributes:
        ports: {output port of the diagram: its named view, or None for a vector of any size}.
        facts: function of (scenario, diagram) that returns what does not change, a dict for JSON.
        values: function of (simulated time [s], position of the tool in W [m], {port: message}) that returns what
            changes, a dict for JSON.
    """

    ports: Mapping[str, Any]
    facts: Callable[[Any, Any], dict[str, Any]]
    values: Callable[[float, np.ndarray, Mapping[str, Any]], dict[str, Any]]
