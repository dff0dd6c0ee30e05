"""The strips of the live view for the conveyor."""

import numpy as np

from drake_tracker.core.messages import BELT_FIELDS, BeltEstimate, Prediction, message_rows, packet_target
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


def conveyor_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `CONVEYOR_STRIPS`, None for an unknown value.

    The first two are about the part that the newest packet describes; the true speed is the mean of the parts on the
    belt.

    Args:
        inputs: values of a run; ``states`` are those of all parts, and ``report`` is a `BeltEstimate`.
    """
    number = packet_target(Prediction(inputs.packet).seq)
    tracking = prediction = None
    if 1 <= number <= len(inputs.states):
        inputs = inputs._replace(p_WQ=inputs.states[number - 1, 4:7])
        tracking, prediction = horizontal_distance(inputs.p_WT, inputs.p_WQ), prediction_error(inputs)
    report = inputs.report
    numbers = message_rows(np.asarray(report[:]), BELT_FIELDS)[:, 0].astype(int)
    numbers = numbers[(numbers > 0) & (numbers <= len(inputs.states))]
    true_speed = 1e3 * float(np.mean(inputs.states[numbers - 1, _VY])) if len(numbers) else None
    speed = 1e3 * report.speed if report.valid and len(numbers) else None
    return rounded((tracking, prediction, true_speed, speed, float(len(numbers))))


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
