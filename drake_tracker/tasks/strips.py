"""The strips of the live view: small charts of errors over time, and the arithmetic that the tasks share.

Errors are measured against the simulator's ground truth, which the tracking loop never sees. `tasks.train.strips` and
`tasks.ball.strips` have the strips of each task.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drake_tracker.core.messages import Prediction, evaluate_prediction

FAINT, BRIGHT = "faint", "bright"
"""Line styles: faint for what was measured or commanded, bright for what resulted from it."""
OLDEST_POINT = 0.6
"""Greatest age [s] of a point whose arc length is shown: a little more than twice the vision lag."""


@dataclass(frozen=True)
class Strip:
    """One strip of the page.

    Attributes:
        title: name of the strip.
        meaning: what it shows, a few words.
        unit: unit of its values.
        top: upper end of its scale; the lower end is 0.
        decimals: decimals of the newest value in print.
        lines: (name, `FAINT` or `BRIGHT`) of each line; one value for each.
    """

    title: str
    meaning: str
    unit: str
    top: float
    decimals: int = 1
    lines: tuple[tuple[str, str], ...] = (("", BRIGHT),)


class StripInputs(NamedTuple):
    """The values of a run at one instant, from which the strips are computed.

    Attributes:
        now: simulated time [s].
        p_WT: tool position in W [m].
        p_WQ: true position of the object in W [m].
        packet: `Prediction` vector that was delivered to the arm.
        filtered: `Filtered` message.
        command: `ArmCommand` message.
        points: the two newest valid `TrackPoint` messages, older first, or fewer.
        report: the task's own message, see `StripChart.report_view`.
    """

    now: float
    p_WT: np.ndarray
    p_WQ: np.ndarray
    packet: np.ndarray
    filtered: Any
    command: Any
    points: tuple[Any, ...]
    report: Any


@dataclass(frozen=True)
class StripChart:
    """The strips of a task, and where their values come from.

    Attributes:
        strips: from top to bottom.
        span: simulated time in view [s].
        values: function of `StripInputs` that returns one value for each line of the strips, None where unknown.
        state_port: output port of the diagram with the object's true state, 13 elements (quaternion, position, rates).
        report_port: output port of the diagram with the task's own message.
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
    """Returns the horizontal distance [mm] of the predicted present position from the true one.

    None while there is no valid packet, or while the arm follows an older one (a frozen command).
    """
    if inputs.command.frozen or not Prediction(inputs.packet).valid:
        return None
    return horizontal_distance(evaluate_prediction(inputs.packet, inputs.now), inputs.p_WQ)


def arc_lengths(inputs: StripInputs) -> tuple[float | None, float | None]:
    """Returns the arc length [mm] between the two newest points: as measured, and as filtered.

    Both are None while there are fewer than two points or the newest is older than `OLDEST_POINT`; the filtered one is
    None while the filter has no valid state.
    """
    if len(inputs.points) < 2 or inputs.now - inputs.points[-1].stamp > OLDEST_POINT:
        return None, None
    earlier, later = inputs.points
    measured = float(np.linalg.norm([later.x - earlier.x, later.y - earlier.y, later.z - earlier.z]))
    time = later.stamp - earlier.stamp
    return 1e3 * measured, 1e3 * inputs.filtered.speed * time if inputs.filtered.valid else None


def horizontal_distance(first: Any, second: Any) -> float:
    """Returns the horizontal distance [mm] of two positions (x, y, ...) [m]."""
    return 1e3 * float(np.hypot(first[0] - second[0], first[1] - second[1]))


def rounded(values: Iterable[float | None]) -> list[float | None]:
    """Returns the values with three decimals, fit for JSON; None for what is None or not finite."""
    return [round(float(value), 3) if value is not None and np.isfinite(value) else None for value in values]
