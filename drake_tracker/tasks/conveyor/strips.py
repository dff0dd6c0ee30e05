"""The strips of the live view for the conveyor."""

import numpy as np

from drake_tracker.core.messages import BELT_FIELDS, BeltEstimate, Prediction, message_rows, predicted_points
from drake_tracker.tasks.strips import (
    BRIGHT,
    FAINT,
    PREDICTION_STRIP,
    Strip,
    StripChart,
    StripInputs,
    horizontal_distance,
    prediction_error,
    rounded,
)

_VY = 11
"""Velocity along the belt in the state of a free body."""
_SAME = 0.05
"""Distance up to which a true part is the one that a packet describes [m]."""
_PLACE = [BELT_FIELDS.index("x"), BELT_FIELDS.index("y")]


def conveyor_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `CONVEYOR_STRIPS`, None for an unknown value.

    The first two are about the part that the newest packet describes, the true one nearest to its prediction; the true
    speed is the mean of the parts that the host knows.

    Args:
        inputs: values of a run; ``states`` are those of all parts, and ``report`` is a `BeltEstimate`.
    """
    tracking = prediction = p_WQ = None
    if Prediction(inputs.packet).valid:
        expected = predicted_points(inputs.packet, np.array([inputs.now]))
        p_WQ = inputs.states[_nearest(inputs.states, expected[:, :2])[0], 4:7]
        if np.linalg.norm(p_WQ[:2] - expected[0, :2]) > _SAME:
            p_WQ = None
    if p_WQ is not None:
        inputs = inputs._replace(p_WQ=p_WQ)
        tracking, prediction = horizontal_distance(inputs.p_WT, inputs.p_WQ), prediction_error(inputs)
    report = inputs.report
    rows = message_rows(np.asarray(report[:]), BELT_FIELDS)
    places = rows[rows[:, 0] > 0.0][:, _PLACE]
    true_speed = speed = None
    if len(places):
        true_speed = 1e3 * float(np.mean(inputs.states[_nearest(inputs.states, places), _VY]))
        speed = 1e3 * report.speed if report.valid else None
    return rounded((tracking, prediction, true_speed, speed, float(len(places))))


def _nearest(states: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Returns which of the parts are nearest to places (x, y) of shape (n, 2) [m], shape (n,)."""
    return np.linalg.norm(states[:, None, 4:6] - places, axis=2).argmin(axis=0)


CONVEYOR_STRIPS = StripChart(
    strips=(
        Strip("Tracking error", "hand to the part", "mm", 200.0),
        PREDICTION_STRIP,
        Strip("Belt speed", "of the parts: true, estimated", "mm/s", 400.0, 1, (("", FAINT), ("", BRIGHT))),
        Strip("Parts", "on the belt, in view", "", 16.0, 0),
    ),
    span=20.0,
    values=conveyor_strip_values,
    state_port="truth_part_states",
    report_port="belt",
    report_view=BeltEstimate,
)
"""Tracking error, prediction error, speed of the belt, and number of parts in view."""
