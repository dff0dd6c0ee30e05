"""The strips of the live view for the train."""

from drake_tracker.core.messages import JawState
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


def train_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `TRAIN_STRIPS` [mm], None for an unknown value.

    Args:
        inputs: values of a run; ``report`` is a `JawState`.
    """
    tracking = horizontal_distance(inputs.p_WT, inputs.p_WQ)
    jaws = (1e3 * inputs.command.jaw_width, 1e3 * inputs.report.width)
    return rounded((tracking, prediction_error(inputs), *arc_lengths(inputs), *jaws))


TRAIN_STRIPS = StripChart(
    strips=(
        Strip("Tracking error", "hand to train, horizontal", "mm", 60.0),
        PREDICTION_STRIP,
        Strip("Arc length", "between points: measured, filtered", "mm", 10.0, 2, (("", FAINT), ("", BRIGHT))),
        Strip("Jaw width", "commanded, measured", "mm", 100.0, 1, (("", FAINT), ("", BRIGHT))),
    ),
    span=20.0,
    values=train_strip_values,
    state_port="truth_train_state",
    report_port="jaws",
    report_view=JawState,
)
"""Tracking error, prediction error, arc length and jaw width."""
