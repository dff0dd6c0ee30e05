import subprocess
import sys

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import KNOT_COUNT, KNOT_FIELDS, Prediction, message_size, pack_prediction
from drake_tracker.core.timing import ESTIMATOR_SLOT, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.link.config import Lossy, Perfect
from drake_tracker.link.link_system import add_link, make_link

FIRST = 3
"""Cycle of the first valid packet: an estimator has none before."""


class Source(LeafSystem):
    """Stands for the estimator: a new packet every cycle, in the estimator's slot."""

    def __init__(self):
        LeafSystem.__init__(self)
        size = message_size(Prediction)
        self.DeclareStateOutputPort("packet", self.DeclareDiscreteState(size))
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, vision_slot(ESTIMATOR_SLOT), self._update)

    def _update(self, context, state):
        seq = round(context.get_time() / VISION_PERIOD)
        if seq >= FIRST:
            knots = np.full((KNOT_COUNT, len(KNOT_FIELDS)), float(seq))
            state.set_value(0, pack_prediction(context.get_time(), seq, knots))


def simulator_of(settings, seed=0):
    builder = DiagramBuilder()
    source = builder.AddNamedSystem("source", Source())
    link = add_link(builder, settings=settings, packet=source.GetOutputPort("packet"), seed=seed)
    builder.ExportOutput(link.GetOutputPort("delivered"), "delivered")
    return Simulator(builder.Build())


def deliveries(simulator, count):
    """The seq read at 3/4 of the plant step that follows each of ``count`` cycles, the slot in which the arm reads."""
    context, diagram = simulator.get_context(), simulator.get_system()
    start = round(context.get_time() / VISION_PERIOD + 0.5)
    rows = []
    for cycle in range(start, start + count):
        simulator.AdvanceTo(cycle * VISION_PERIOD + 0.75 * TIME_STEP)
        rows.append(Prediction(diagram.GetOutputPort("delivered").Eval(context)).seq)
    return np.array(rows)


def test_through_a_perfect_link_the_packet_of_this_very_cycle_is_read():
    simulator = simulator_of(Perfect())
    seqs = deliveries(simulator, 30)
    expected = np.arange(30.0)
    expected[:FIRST] = 0.0
    np.testing.assert_array_equal(seqs, expected)
    packet = simulator.get_system().GetOutputPort("delivered").Eval(simulator.get_context())
    assert Prediction(packet).valid == 1.0 and packet[-1] == 29.0


def test_a_delayed_packet_appears_between_updates_at_the_moment_it_arrives():
    # Without time among the output's prerequisites the value read just before would be served again.
    simulator = simulator_of(Lossy(delay=0.005))
    context, port = simulator.get_context(), simulator.get_system().GetOutputPort("delivered")
    posted = FIRST * VISION_PERIOD + 0.5 * TIME_STEP
    simulator.AdvanceTo(posted + 0.0049)
    np.testing.assert_array_equal(port.Eval(context), np.zeros(message_size(Prediction)))
    simulator.AdvanceTo(posted + 0.0051)
    assert Prediction(port.Eval(context)).seq == FIRST


def test_losses_and_lateness_only_ever_give_way_to_something_newer():
    seqs = deliveries(simulator_of(Lossy(drop=0.5, delay=0.05, jitter=0.1), seed=2), 300)
    steps = np.diff(seqs)
    assert steps.min() == 0.0 and steps.max() > 2.0  # it waits, and catches up
    age = (np.arange(300) - seqs)[seqs > 0]
    assert age.min() >= 3  # .05 s


def test_a_run_replays_from_any_copy_of_its_context():
    faults = Lossy(drop=0.4, delay=0.02, jitter=0.08, burst=3)
    first = simulator_of(faults, seed=6)
    deliveries(first, 60)
    middle = first.get_context().Clone()
    rest = deliveries(first, 60)
    np.testing.assert_array_equal(deliveries(Simulator(first.get_system(), middle), 60), rest)
    np.testing.assert_array_equal(deliveries(simulator_of(faults, seed=6), 120)[60:], rest)


def test_the_output_does_not_feed_through():
    assert not make_link(Perfect()).HasAnyDirectFeedthrough()


def test_faults_out_of_range_are_refused():
    with pytest.raises(DrakeTrackerError, match="link drop is 2"):
        make_link(Lossy(drop=2))


def test_settings_of_no_kind_are_refused():
    with pytest.raises(DrakeTrackerError, match="link: kind is .*; allowed are lossy, perfect"):
        make_link(Source)


def test_the_settings_do_not_load_drake():
    code = "import sys; from drake_tracker.link import Lossy; assert 'pydrake' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
