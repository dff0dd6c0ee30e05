"""Tests of the source of a recorded signal, which agrees with the recorded port at every instant."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import GRASP_SLOT, PROJECTOR_SLOT, SERVO_PERIOD, TIME_STEP, VISION_PERIOD, servo_slot
from drake_tracker.replay.parts import LogSourceSystem

END = 0.5
SLOTS = np.arange(16) / 16.0


class Counter(LeafSystem):
    """Counts its updates."""

    def __init__(self, period, offset):
        super().__init__()
        self.DeclareStateOutputPort("signal", self.DeclareDiscreteState([1.0, -1.0]))
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._count)

    def _count(self, context, discrete_state):
        discrete_state.set_value(context.get_discrete_state_vector().value() + [1.0, 0.5])


def shown(system, times, period=None):
    """Returns the values of a System's port at times [s], before the updates, and its log."""
    builder = DiagramBuilder()
    builder.AddSystem(system)
    logger = LogVectorOutput(system.get_output_port(), builder, publish_period=period or VISION_PERIOD)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    rows = []
    for time in times:
        simulator.AdvanceTo(time)
        rows.append(np.array(system.get_output_port().Eval(system.GetMyContextFromRoot(simulator.get_context()))))
    log = logger.FindLog(simulator.get_context())
    return np.array(rows), Signal(log.sample_times().copy(), log.data().T.copy(), ("a", "b"))


@pytest.mark.parametrize(
    "period, offset",
    [
        (VISION_PERIOD, 0.0),
        (VISION_PERIOD, PROJECTOR_SLOT * TIME_STEP),
        (SERVO_PERIOD, servo_slot(GRASP_SLOT)),
    ],
)
def test_the_source_changes_when_the_original_changed(period, offset):
    steps = np.arange(round(END / TIME_STEP))
    times = np.ravel(TIME_STEP * (steps[:, None] + SLOTS))
    original, log = shown(Counter(period, offset), times, period)
    assert len(np.unique(original, axis=0)) > 10
    replayed, again = shown(LogSourceSystem(log, period, offset), times[times <= log.times[-1]], period)
    np.testing.assert_array_equal(replayed, original[: len(replayed)])
    np.testing.assert_array_equal(again.data, log.data[: len(again.times)])


def test_the_last_sample_stays():
    log = Signal(np.array([0.0, VISION_PERIOD]), np.array([[1.0, 2.0], [3.0, 4.0]]), ("a", "b"))
    replayed, _ = shown(LogSourceSystem(log, VISION_PERIOD), [0.5 * VISION_PERIOD, 0.2])
    np.testing.assert_array_equal(replayed, log.data[[1, 1]])


def test_the_source_has_no_direct_feedthrough():
    log = Signal(np.zeros(1), np.zeros((1, 2)), ("a", "b"))
    assert not LogSourceSystem(log, VISION_PERIOD).HasAnyDirectFeedthrough()
