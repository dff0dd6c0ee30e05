from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_tracker.core.messages import KNOT_COUNT, Filtered, Prediction, TrackPoint, evaluate_prediction, message_size
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.estimator_system import EstimatorSystem, add_estimator

LAG = 15 * VISION_PERIOD
RADIUS, SPEED = 0.12, 0.15


def truth(t):
    angle = SPEED * t / RADIUS
    return np.array([0.56 + RADIUS * np.cos(angle), RADIUS * np.sin(angle), 0.485])


class LatePoints(LeafSystem):
    """A circle seen late, a point each vision cycle, none between ``lost`` [s, times of arrival]."""

    def __init__(self, lost=(np.inf, np.inf)):
        super().__init__()
        self._lost = lost
        self.DeclareDiscreteState(message_size(TrackPoint))
        self.DeclareStateOutputPort("point", self.DeclareDiscreteState(message_size(TrackPoint)))
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, 0.0, self._update)

    def _update(self, context, state):
        stamp = context.get_time() - LAG
        seen = stamp >= 0.0 and not self._lost[0] <= context.get_time() < self._lost[1]
        value = np.concatenate([[stamp], truth(stamp), [0.0, 1.0]]) if seen else np.zeros(6)
        state.get_mutable_vector(1).SetFromVector(value)
        return EventStatus.Succeeded()


def build(lost=(np.inf, np.inf), kind="arc_length"):
    builder = DiagramBuilder()
    points = builder.AddSystem(LatePoints(lost))
    system = add_estimator(builder, estimator=make_estimator(kind), point=points.GetOutputPort("point"))
    logger = LogVectorOutput(system.GetOutputPort("filtered"), builder, publish_period=TIME_STEP)
    builder.ExportOutput(system.GetOutputPort("prediction"), "prediction")
    return builder.Build(), logger


def prediction_at(diagram, simulator, time):
    simulator.AdvanceTo(time)
    return Prediction(diagram.GetOutputPort("prediction").Eval(simulator.get_context()))


def test_predicts_the_present_and_beyond_from_late_points():
    diagram, _ = build()
    simulator = Simulator(diagram)
    assert prediction_at(diagram, simulator, 0.5).valid == 0.0
    packet = prediction_at(diagram, simulator, 2.0 + 0.5 * TIME_STEP)
    assert packet.valid == 1.0
    assert packet.stamp == pytest.approx(2.0 - LAG)
    # evaluate_prediction is linear between knots: a fraction of a millimetre at this curvature
    for time in (2.0, 2.5, 3.0):
        np.testing.assert_allclose(evaluate_prediction(packet[:], time)[:3], truth(time), atol=1e-4)
    stds = packet[:][5:].reshape(KNOT_COUNT, 5)[:, 4]
    assert np.all(np.diff(stds) > 0.0)


def test_lag_is_one_value_and_every_new_point_makes_one_packet():
    diagram, logger = build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(3.0)
    log = logger.FindLog(simulator.get_context())
    stamps, times = log.data()[0], log.sample_times()
    changes = np.flatnonzero(np.diff(stamps) > 0.0) + 1
    # the estimator's slot is a quarter of a plant step after the point, and the log reads at the next plant step
    np.testing.assert_allclose(times[changes] - stamps[changes], LAG + TIME_STEP, atol=1e-9)
    first = prediction_at(diagram, simulator, 3.0 + TIME_STEP).seq
    second = prediction_at(diagram, simulator, 3.5 + TIME_STEP).seq
    assert second - first == 30


def test_without_new_points_the_last_packet_stays_and_its_stamp_tells_its_age():
    diagram, _ = build(lost=(2.0, 4.0))
    simulator = Simulator(diagram)
    before = prediction_at(diagram, simulator, 2.0 + 2 * TIME_STEP)[:].copy()
    np.testing.assert_array_equal(prediction_at(diagram, simulator, 3.9)[:], before)
    after = prediction_at(diagram, simulator, 5.5)
    assert after.seq > before[1] and after.stamp > 5.0
    np.testing.assert_allclose(evaluate_prediction(after[:], 6.0)[:3], truth(6.0), atol=1e-4)


class Stubborn:
    """An estimator that counts the points that it is offered and keeps no stamp."""

    def initial_state(self):
        return SimpleNamespace(stamp=-np.inf, offered=0)

    def update(self, state, stamp, p_WQ):
        return state if p_WQ is None else SimpleNamespace(stamp=-np.inf, offered=state.offered + 1)

    def ready(self, state):
        return False


def test_a_held_point_is_offered_once_even_if_the_estimator_ignores_it():
    builder = DiagramBuilder()
    held = np.array([0.0, *truth(1.0), 0.0, 1.0])
    source = builder.AddSystem(ConstantVectorSource(held))
    system = builder.AddSystem(EstimatorSystem(Stubborn()))
    builder.Connect(source.get_output_port(), system.GetInputPort("point"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(10 * VISION_PERIOD)
    context = system.GetMyContextFromRoot(simulator.get_context())
    assert context.get_abstract_state(0).get_value().estimate.offered == 1


def test_outputs_have_no_feedthrough_and_a_clone_replays_bit_for_bit():
    system = EstimatorSystem(make_estimator("arc_length"))
    assert not system.HasAnyDirectFeedthrough()
    assert system.GetOutputPort("filtered").size() == message_size(Filtered)
    diagram, _ = build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.5)
    clone = Simulator(diagram, simulator.get_context().Clone())
    first = prediction_at(diagram, simulator, 2.5)[:].copy()
    np.testing.assert_array_equal(prediction_at(diagram, clone, 2.5)[:], first)


def test_a_second_kind_runs_in_the_same_system():
    diagram, _ = build(kind="alpha_beta_gamma")
    simulator = Simulator(diagram)
    packet = prediction_at(diagram, simulator, 3.0)
    np.testing.assert_allclose(evaluate_prediction(packet[:], 3.0)[:3], truth(3.0), atol=0.02)


def test_the_estimator_starts_again_when_the_point_is_that_of_another_object():
    builder = DiagramBuilder()
    points = builder.AddSystem(LatePoints())
    system = builder.AddSystem(EstimatorSystem(make_estimator("arc_length"), numbered=True))
    number = builder.AddSystem(ConstantVectorSource([1.0]))
    builder.Connect(points.GetOutputPort("point"), system.GetInputPort("point"))
    builder.Connect(number.get_output_port(), system.GetInputPort("number"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    context, source = system.GetMyContextFromRoot(root), number.GetMyMutableContextFromRoot(root)

    def packet():
        return Prediction(system.GetOutputPort("prediction").Eval(context))

    simulator.AdvanceTo(2.0)
    seq = packet().seq
    number.get_mutable_source_value(source).SetFromVector([0.0])  # no object for a while: nothing changes
    simulator.AdvanceTo(2.1)
    assert packet().valid and packet().seq > seq
    seq = packet().seq
    number.get_mutable_source_value(source).SetFromVector([2.0])
    simulator.AdvanceTo(2.1 + 2 * VISION_PERIOD)
    assert not packet().valid and not system.GetOutputPort("filtered").Eval(context).any()
    simulator.AdvanceTo(4.0)
    assert packet().valid and packet().seq > seq
