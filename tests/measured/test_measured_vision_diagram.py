"""The stand-in for the cameras as a Drake System: stamps, lag, what is not seen."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.core.messages import TrackPoint
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.measured.measured_error import MeasuredError
from drake_tracker.measured.measured_error_system import MeasuredErrorSystem
from drake_tracker.measured.measured_vision_diagram import MeasuredVisionDiagram
from drake_tracker.tasks.train.scenario import WORK_VOLUME


class Train(LeafSystem):
    """Runs along x at 0.1 m/s; the port is the state of a free body."""

    def __init__(self, speed=0.1):
        super().__init__()
        self._speed = speed
        self.DeclareVectorOutputPort("state", 13, self._calc, {self.time_ticket()})

    def place(self, time):
        return 0.4 + self._speed * time

    def _calc(self, context, output):
        x = self.place(context.get_time())
        output.SetFromVector([1.0, 0, 0, 0, x, 0.05, 0.485, 0, 0, 0, self._speed, 0, 0])


def shifted(missing=0.0, seen_from=0.01, along=0.002):
    """An error that is nothing but 2 mm along the heading."""
    bias = np.zeros((1, 2, 4, 3))
    bias[:, 0, :, 0] = along
    return MeasuredError(
        np.array([0.1]), bias, np.zeros((1, 3)), np.zeros((1, 3, 1)), np.array([[missing, 1.0]]), 0.003, seen_from
    )


def run(error, lag_cycles, cycles, train=None, work_volume=WORK_VOLUME):
    """Returns the points (n, 6) as the estimator would read them, one each cycle from time 0 on."""
    builder = DiagramBuilder()
    train = builder.AddSystem(train or Train())
    vision = builder.AddSystem(MeasuredVisionDiagram([MeasuredErrorSystem(error, work_volume, 3)], lag_cycles))
    builder.Connect(train.get_output_port(), vision.GetInputPort("truth_train_state"))
    builder.ExportOutput(vision.GetOutputPort("point"), "point")
    simulator = Simulator(builder.Build())
    points = []
    for k in range(cycles):
        simulator.AdvanceTo(k * VISION_PERIOD + vision_slot(ESTIMATOR_SLOT))
        points.append(simulator.get_system().GetOutputPort("point").Eval(simulator.get_context()).copy())
    return np.array(points)


@pytest.mark.parametrize("lag", [0, 1, 15, 30])
def test_a_point_comes_a_lag_after_its_stamp_and_describes_that_instant(lag):
    points = run(shifted(), lag, lag + 20)
    for k, row in enumerate(points):
        point = TrackPoint(row)
        if k < lag + 1:
            assert not row.any(), "no capture at time 0, as there is no motion in one image"
            continue
        assert point.stamp == pytest.approx((k - lag) * VISION_PERIOD, abs=1e-12)
        assert point.valid == 1.0
        assert (point.x, point.y, point.z) == pytest.approx((Train().place(point.stamp) + 0.002, 0.05, 0.485))


def test_a_drop_out_and_a_train_too_slow_leave_a_stamp_without_a_point():
    for error in (shifted(missing=1.0), shifted(seen_from=0.2)):
        points = run(error, 2, 10)
        assert np.all(points[3:, 0] > 0.0) and not points[:, 1:].any()


def test_outside_the_work_volume_nothing_is_seen():
    small = [[0.3, -0.3, 0.45], [0.36, 0.3, 0.505]]  # and 0.05 m of margin: up to x = 0.41
    points = run(shifted(along=0.0), 0, 20, work_volume=small)
    valid = points[1:, -1] > 0
    assert valid[0] and not valid[-1]
    assert np.array_equal(valid, Train().place(points[1:, 0]) <= 0.41)


def test_a_context_copied_half_way_goes_on_alike():
    builder = DiagramBuilder()
    train = builder.AddSystem(Train())
    error = shifted()
    error = replace(error, pattern=error.pattern + 1e-3, jitter=np.full((1, 3, 5), 1e-3))
    vision = builder.AddSystem(MeasuredVisionDiagram([MeasuredErrorSystem(error, WORK_VOLUME, 9)], 3))
    builder.Connect(train.get_output_port(), vision.GetInputPort("truth_train_state"))
    builder.ExportOutput(vision.GetOutputPort("point"), "point")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.3)
    twin = Simulator(diagram, simulator.get_context().Clone())
    for each in (simulator, twin):
        each.AdvanceTo(0.6)
    a, b = (diagram.GetOutputPort("point").Eval(each.get_context()) for each in (simulator, twin))
    assert np.array_equal(a, b) and a[-1] == 1.0
