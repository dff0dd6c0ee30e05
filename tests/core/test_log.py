"""Tests of the log."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.differential_ik import joints_for
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal, load_log, save_log
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.run.log_recorder import add_loggers, read_log, tool_signal
from drake_tracker.tasks.train.task import TASK


class Clock(LeafSystem):
    """Has every port that is logged; all fields of a port show the time plus their index."""

    def __init__(self):
        super().__init__()
        for name, (_, fields) in TASK.signals().items():
            self.DeclareVectorOutputPort(name, len(fields), self._calc)

    @staticmethod
    def _calc(context, output):
        output.SetFromVector(context.get_time() + np.arange(output.size()))


@pytest.fixture(scope="module")
def log():
    builder = DiagramBuilder()
    clock = builder.AddSystem(Clock())
    loggers = add_loggers(builder, clock, TASK)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    return read_log(loggers, simulator.get_context(), TASK)


def test_every_signal_is_logged_at_its_period(log):
    assert set(log) == set(TASK.signals())
    for name, (period, fields) in TASK.signals().items():
        signal = log[name]
        np.testing.assert_allclose(signal.times, period * np.arange(len(signal.times)), atol=1e-9)
        assert len(signal.times) == int(0.1 / period + 1e-9) + 1
        assert signal.names == tuple(fields)


def test_fields_are_found_by_name(log):
    point = log["point"]
    np.testing.assert_allclose(point["stamp"], point.times)
    np.testing.assert_allclose(point["y"], point.times + 2)
    np.testing.assert_allclose(point.view("z", "x"), np.column_stack([point.times + 3, point.times + 1]))
    with pytest.raises(ValueError):
        point["nothing"]


def test_what_is_saved_is_loaded(log, tmp_path):
    save_log(log, tmp_path / "log.npz")
    loaded = load_log(tmp_path / "log.npz")
    assert set(loaded) == set(log)
    for name, signal in log.items():
        assert loaded[name].names == signal.names
        np.testing.assert_array_equal(loaded[name].times, signal.times)
        np.testing.assert_array_equal(loaded[name].data, signal.data)


def test_a_log_that_contains_text_is_rejected_as_damaged(tmp_path):
    words = np.array([["one"]])
    np.savez(tmp_path / "log.npz", **{"point": words, "point.time": np.zeros(1), "point.names": np.array(["x"])})
    with pytest.raises(DrakeTrackerError, match="log.npz: this log is damaged.*not numbers"):
        load_log(tmp_path / "log.npz")


def test_tool_comes_from_forward_kinematics():
    model = make_arm_model(PUMA560)
    X_WT = tool_down((0.6, 0.1, 0.7), 0.4)
    q = joints_for(model, PUMA560.q_start, X_WT)
    times = TIME_STEP * np.arange(11)
    state = Signal(times, np.tile(np.concatenate([q, np.zeros(6)]), (11, 1)), TASK.signals()["arm_state"][1])
    tool = tool_signal(state, model)
    np.testing.assert_allclose(tool.times, [0.0, 1 / 60, 2 / 60], atol=1e-9)
    np.testing.assert_allclose(tool.data, np.tile([0.6, 0.1, 0.7, 0.4], (3, 1)), atol=1e-5)
