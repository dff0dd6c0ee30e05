"""Tests of the values of the live view's strips."""

import numpy as np
import pytest

from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    ArmCommand,
    CatchDiagnosis,
    Filtered,
    JawState,
    Prediction,
    TrackPoint,
    message_size,
    pack_prediction,
)
from drake_tracker.tasks.ball.filming import BALL_STRIPS
from drake_tracker.tasks.strips import StripInputs
from drake_tracker.tasks.train.pictures.filming import TRAIN_STRIPS

NOW = 2.0


def packet():
    """A prediction of an object that moves along x at 0.1 m/s and was at x = 0.5 m at 1.75 s."""
    knots = np.zeros((KNOT_COUNT, 5))
    knots[:, 0] = 0.5 + 0.1 * KNOT_SPACING * np.arange(KNOT_COUNT)
    return pack_prediction(1.75, 3, knots)


def view(kind, **values):
    message = kind(np.zeros(message_size(kind)))
    for key, value in values.items():
        setattr(message, key, value)
    return message


def inputs(**changed):
    values = dict(
        now=NOW,
        p_WT=np.array([0.53, 0.04, 0.9]),
        p_WQ=np.array([0.53, 0.0, 0.5]),
        packet=packet(),
        filtered=view(Filtered, speed=0.12, valid=1.0),
        command=view(ArmCommand, jaw_width=0.088),
        points=(view(TrackPoint, stamp=1.70, x=0.49), view(TrackPoint, stamp=1.75, x=0.5, z=0.001)),
        report=view(JawState, width=0.04),
        states=np.zeros((1, 13)),
    )
    return StripInputs(**{**values, **changed})


def of_train(**changed):
    return TRAIN_STRIPS.values(inputs(**changed))


def test_the_strips_of_a_train():
    tracking, prediction, measured, filtered, commanded, jaws = of_train()
    assert tracking == pytest.approx(40.0), "horizontal distance of the hand"
    assert prediction == pytest.approx(5.0), "0.25 s after its stamp the packet predicts 0.525 m"
    assert measured == pytest.approx(np.hypot(10.0, 1.0), abs=1e-3)
    assert filtered == pytest.approx(6.0), "0.12 m/s for 0.05 s"
    assert (commanded, jaws) == (88.0, 40.0)


def test_unknown_values_are_none():
    nothing = of_train(packet=np.zeros(message_size(Prediction)), points=(), filtered=view(Filtered))
    assert nothing[1:4] == [None, None, None]
    assert of_train(filtered=view(Filtered))[2:4] == [pytest.approx(10.05, abs=0.01), None]
    assert of_train(command=view(ArmCommand, frozen=1.0))[1] is None, "the arm follows an older packet"
    assert of_train(now=NOW + 1.0)[2:4] == [None, None], "the points are too old"
    assert of_train(p_WQ=np.full(3, np.nan))[:2] == [None, None]


def test_the_strips_of_a_ball():
    expected = view(CatchDiagnosis, known=1.0, time_left=0.5, x=0.53, y=0.1)
    values = BALL_STRIPS.values(inputs(report=expected))
    assert values[0] == pytest.approx(60.0) and values[-1] == 0.5
    passed = BALL_STRIPS.values(inputs(report=view(CatchDiagnosis, known=1.0, time_left=-0.1)))
    assert [passed[0], passed[-1]] == [None, None]


@pytest.mark.parametrize("chart", [TRAIN_STRIPS, BALL_STRIPS])
def test_every_line_has_a_value(chart):
    values = chart.values(inputs(report=view(chart.report_view)))
    assert len(values) == sum(len(strip.lines) for strip in chart.strips)
