"""The stand-in for cameras that see parts on a belt."""

import numpy as np
import pytest
from belt_parts import BELT_HEIGHT, part_state
from pydrake.systems.analysis import Simulator
from variants import variant

from drake_tracker.core.messages import PART_FIELDS, PART_SLOTS, PartTracks, message_rows
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.config import MeasuredParts
from drake_tracker.measured.measured_parts_system import MeasuredPartsSystem
from drake_tracker.measured.measured_vision_diagram import MeasuredVisionDiagram

VIEW = np.array([[0.48, -0.45], [0.72, 0.50]])
EXACT = variant(MeasuredParts, noise_std=0.0, bias_std=0.0, turn_noise_std_deg=0.0, turn_bias_std_deg=0.0)()


def make(states, settings=EXACT, kinds=None, seed=1):
    system = MeasuredPartsSystem(
        settings, kinds or [PartKind.BOX] * len(states), belt_height=BELT_HEIGHT, view=VIEW, seed=seed
    )
    context = system.CreateDefaultContext()
    system.GetInputPort("truth_part_states").FixValue(context, np.ravel(states))
    return system, context


def seen(states, time=1.0, **changes):
    """The tracks at a time, one row for each part that is seen."""
    system, context = make(states, **changes)
    context.SetTime(time)
    message = np.array(system.GetOutputPort("parts").Eval(context))
    rows = message_rows(message, PART_FIELDS)
    assert PartTracks(message).stamp == pytest.approx(time)
    return rows[rows[:, 0] > 0]


def test_without_errors_it_reports_the_true_poses():
    rows = seen([part_state(PartKind.BOX, 0.55, -0.2, 2.5), part_state(PartKind.ELL, 0.65, 0.1, -1.0)],
                kinds=[PartKind.BOX, PartKind.ELL])  # fmt: skip
    assert rows[:, :2].tolist() == [[2.0, PartKind.ELL], [1.0, PartKind.BOX]], "those farthest downstream first"
    assert rows[1, 2:6] == pytest.approx([0.55, -0.2, BELT_HEIGHT + 0.015, 2.5])
    assert rows[0, 5] == pytest.approx(-1.0)
    assert (rows[:, 9] == 1.0).all() and (rows[:, 8] > 0.0).all()


@pytest.mark.parametrize(
    "state",
    [
        part_state(PartKind.BOX, 0.6, -0.46, 0.0),
        part_state(PartKind.BOX, 0.6, 0.51, 0.0),
        part_state(PartKind.BOX, 0.41, 0.0, 0.0),
        part_state(PartKind.BOX, 0.6, 0.0, 0.0, rise=0.02),
    ],
    ids=["upstream", "past the end", "in a tray", "held"],
)
def test_a_part_that_is_not_on_the_belt_in_view_is_not_seen(state):
    assert len(seen([state])) == 0


def test_before_the_first_cycle_there_is_no_image():
    system, context = make([part_state(PartKind.BOX, 0.6, 0.0, 0.0)])
    assert not np.any(system.GetOutputPort("parts").Eval(context))


def test_when_there_are_more_parts_than_slots_those_farthest_downstream_are_reported():
    states = [part_state(PartKind.DISC, 0.6, -0.4 + 0.045 * k, 0.0) for k in range(PART_SLOTS + 3)]
    rows = seen(states, kinds=[PartKind.DISC] * len(states))
    assert rows[:, 0].tolist() == list(range(PART_SLOTS + 3, 3, -1))


def test_the_errors_have_the_standard_deviations_of_the_settings_and_part_of_them_stays():
    settings = variant(MeasuredParts, noise_std=0.002, bias_std=0.004, turn_noise_std_deg=1.0, turn_bias_std_deg=3.0)()
    states = [part_state(PartKind.BOX, 0.5 + 0.01 * k, 0.0, 0.0) for k in range(PART_SLOTS)]
    found = np.array([
        seen(states, VISION_PERIOD * cycle, settings=settings, seed=seed)[:, [0, 2, 3, 5]]
        for seed in range(8) for cycle in range(1, 26)
    ]).reshape(8, 25, PART_SLOTS, 4)  # fmt: skip
    order = np.argsort(found[..., 0], axis=2)
    error = np.take_along_axis(found, order[..., None], axis=2)[..., 1:] - np.array(
        [[0.5 + 0.01 * k, 0.0, 0.0] for k in range(PART_SLOTS)]
    )
    constant = error.mean(axis=1)
    assert (error - constant[:, None]).std(axis=(0, 1, 2)) == pytest.approx([0.002, 0.002, np.deg2rad(1.0)], rel=0.1)
    assert constant.std(axis=(0, 1)) == pytest.approx([0.004, 0.004, np.deg2rad(3.0)], rel=0.25)


def test_the_same_seed_gives_the_same_errors_and_another_one_others():
    states, settings = [part_state(PartKind.BOX, 0.6, 0.0, 0.0)], MeasuredParts()
    first, again, other = (seen(states, 2.0, settings=settings, seed=seed) for seed in (1, 1, 2))
    assert (first == again).all() and not (first == other).all()
    assert not (first == seen(states, 3.0, settings=settings, seed=1)).all()


def test_the_diagram_is_late_by_its_lag():
    system, _ = make([part_state(PartKind.BOX, 0.6, 0.0, 0.0)])
    diagram = MeasuredVisionDiagram([system], 15)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.GetInputPort("truth_part_states").FixValue(context, part_state(PartKind.BOX, 0.6, 0.0, 0.0))
    simulator.AdvanceTo(1.0 + 0.5 * VISION_PERIOD)
    assert PartTracks(diagram.GetOutputPort("parts").Eval(context)).stamp == pytest.approx(1.0 - 15 * VISION_PERIOD)


def test_a_part_on_its_side_is_there_as_another_one_and_not_measured():
    lying = np.array(part_state(PartKind.BOX, 0.6, -0.1, 0.0, rise=0.0115))
    lying[:4] = [np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0]
    rows = seen([lying, part_state(PartKind.BOX, 0.6, -0.2, 0.0)])
    assert rows[:, 0].tolist() == [3.0, 2.0], "a hand that knew the first part must not go where it was"
    assert rows[0, 6] == 1.0 and rows[1, 6] < 1e-4
