"""The strips of the live view for the ball."""

from drake_tracker.core.messages import CatchDiagnosis
from drake_tracker.tasks.strips import (
    BRIGHT,
    FAINT,
    PREDICTION_STRIP,
    Strip,
    StripChart,
    StripInputs,
    arc_lengths,
    horizontal_distance,
    prediction_error,
    rounded,
)


def ball_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `BALL_STRIPS` ([mm], the last one [s]), None for an unknown value.

    Args:
        inputs: values of a run; ``report`` is a `CatchDiagnosis`.
    """
    expected = inputs.report
    known = expected.known and expected.time_left >= 0.0
    tracking = horizontal_distance(inputs.p_WT, (expected.x, expected.y)) if known else None
    time_left = expected.time_left if known else None
    return rounded((tracking, prediction_error(inputs), *arc_lengths(inputs), time_left))


BALL_STRIPS = StripChart(
    strips=(
        Strip("Tracking error", "cup to the predicted crossing", "mm", 200.0),
        PREDICTION_STRIP,
        Strip("Arc length", "between points: measured, filtered", "mm", 80.0, 1, (("", FAINT), ("", BRIGHT))),
        Strip("Time left", "until the ball is over the cup", "s", 2.0, 2),
    ),
    span=10.0,
    values=ball_strip_values,
    state_port="truth_ball_state",
    report_port="diagnosis",
    report_view=CatchDiagnosis,
)
"""Tracking error, prediction error, arc length and time left."""
