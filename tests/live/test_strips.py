"""What the strips show, from the vectors of a run."""

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
from drake_tracker.live.strips import STRIPS, Sights, measure

NOW = 2.0


def packet():
    """Of an object that runs along x at 0.1 m/s and was at x = 0.5 m at 1.75 s."""
    knots = np.zeros((KNOT_COUNT, 5))
    knots[:, 0] = 0.5 + 0.1 * KNOT_SPACING * np.arange(KNOT_COUNT)
    return pack_prediction(1.75, 3, knots)


def view(kind, **values):
    message = kind(np.zeros(message_size(kind)))
    for key, value in values.items():
        setattr(message, key, value)
    return message


def sights(**changed):
    values = dict(
        now=NOW,
        p_WT=np.array([0.53, 0.04, 0.9]),
        p_WQ=np.array([0.53, 0.0, 0.5]),
        packet=packet(),
        filtered=view(Filtered, speed=0.12, valid=1.0),
        command=view(ArmCommand, jaw_width=0.088),
        points=(view(TrackPoint, stamp=1.70, x=0.49), view(TrackPoint, stamp=1.75, x=0.5, z=0.001)),
        jaws=view(JawState, width=0.04),
    )
    return Sights(**{**values, **changed})


def test_the_strips_of_a_train():
    tracking, prediction, measured, filtered, asked, felt = measure(sights())
    assert tracking == pytest.approx(40.0), "the hand, seen from above"
    assert prediction == pytest.approx(5.0), "0.25 s on, the packet has it at 0.525 m"
    assert measured == pytest.approx(np.hypot(10.0, 1.0), abs=1e-3)
    assert filtered == pytest.approx(6.0), "0.12 m/s for 0.05 s"
    assert (asked, felt) == (88.0, 40.0)


def test_what_is_not_known_is_none():
    nothing = sights(packet=np.zeros(message_size(Prediction)), points=(), filtered=view(Filtered))
    assert measure(nothing)[1:4] == [None, None, None]
    assert measure(sights(filtered=view(Filtered)))[2:4] == [pytest.approx(10.05, abs=0.01), None]
    assert measure(sights(command=view(ArmCommand, frozen=1.0)))[1] is None, "the arm goes by an older packet"
    assert measure(sights(now=NOW + 1.0))[2:4] == [None, None], "those points are old"
    assert measure(sights(p_WQ=np.full(3, np.nan)))[:2] == [None, None]


def test_the_strips_of_a_ball():
    comes = view(CatchDiagnosis, known=1.0, time_left=0.5, x=0.53, y=0.1)
    values = measure(sights(jaws=None, diagnosis=comes))
    assert values[0] == pytest.approx(60.0) and values[-1] == 0.5
    gone = view(CatchDiagnosis, known=1.0, time_left=-0.1)
    assert [measure(sights(jaws=None, diagnosis=gone))[k] for k in (0, -1)] == [None, None]


@pytest.mark.parametrize(
    "task, last", [("train", {"jaws": view(JawState)}), ("ball", {"diagnosis": view(CatchDiagnosis)})]
)
def test_every_line_has_its_value(task, last):
    values = measure(sights(**{"jaws": None, **last}))
    assert len(values) == sum(len(strip.lines) for strip in STRIPS[task])
