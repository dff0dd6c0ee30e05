"""The strips of the live view: their values for a made-up instant, and their System in the diagram of the conveyor."""

import numpy as np
import pytest
from belt_parts import part_state
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.messages import (
    BELT_FIELDS,
    KNOT_COUNT,
    KNOT_SPACING,
    TARGET_STRIDE,
    ArmCommand,
    BeltEstimate,
    Filtered,
    Prediction,
    message_rows,
    message_size,
    pack_prediction,
)
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.live.strips_system import add_strips
from drake_tracker.tasks.conveyor.filming import CONVEYOR_STRIPS, conveyor_strip_values
from drake_tracker.tasks.strips import StripInputs

NOW, SPEED = 5.0, 0.15


def instant(packet, numbers=(1, 2)):
    """The values at `NOW`: two parts on a belt whose speed is estimated 10 mm/s too high."""
    states = np.array([part_state(PartKind.BOX, 0.6, y, 0.0) for y in (0.1, -0.2, -3.0)])
    states[:, 11] = SPEED
    states[2, 11] = 9.0  # not on the belt
    report = np.zeros(message_size(BeltEstimate))
    BeltEstimate(report).speed, BeltEstimate(report).valid = SPEED + 0.010, 1.0
    rows = message_rows(report, BELT_FIELDS)[: len(numbers)]
    rows[:, 0], rows[:, 2:4] = numbers, states[np.array(numbers, dtype=int) - 1, 4:6]
    return StripInputs(
        now=NOW,
        p_WT=np.array([0.6, -0.17, 0.55]),
        p_WQ=states[0, 4:7],
        packet=packet,
        filtered=Filtered(np.zeros(message_size(Filtered))),
        command=ArmCommand(np.zeros(message_size(ArmCommand))),
        points=(),
        report=BeltEstimate(report),
        states=states,
    )


def packet_of(number, y):
    knots = np.column_stack([np.full(KNOT_COUNT, v) for v in (0.6, y, 0.465, 0.0, 0.002)])
    return pack_prediction(NOW - 5 * KNOT_SPACING, number * TARGET_STRIDE + 1, knots)


def test_the_errors_are_about_the_part_of_the_newest_packet():
    values = conveyor_strip_values(instant(packet_of(2, -0.206)))
    assert values == pytest.approx([30.0, 6.0, 150.0, 160.0, 2.0])


def test_without_a_packet_or_parts_values_are_unknown():
    values = conveyor_strip_values(instant(np.zeros(message_size(Prediction)), numbers=()))
    assert values == [None, None, None, None, 0.0]
    assert conveyor_strip_values(instant(packet_of(7, 0.0)))[:2] == [None, None]


def test_there_is_a_value_for_each_line():
    assert sum(len(strip.lines) for strip in CONVEYOR_STRIPS.strips) == 5


def test_the_live_view_can_sample_the_diagram_of_the_conveyor():
    hand_eye = make_diagram(load_scenario("conveyor:measured", seed=5, duration=9.0))
    builder, samples = DiagramBuilder(), []
    builder.AddSystem(hand_eye)
    add_strips(
        builder, hand_eye=hand_eye, chart=CONVEYOR_STRIPS, model=make_arm_model(PUMA560), add_sample=samples.append
    )
    Simulator(builder.Build()).AdvanceTo(0.001)
    assert len(samples) == 1 and samples[0] == (0.0, 0, None, None, None, None, 0.0)
