"""Tests of the age of a prediction when it becomes available, on vision, host and link without a renderer."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem

from drake_tracker.core.messages import KNOT_FIELDS, Prediction, TrackPoint, prediction_knots
from drake_tracker.core.timing import (
    ESTIMATOR_SLOT,
    LAG_CYCLES,
    LINK_SLOT,
    SERVO_PERIOD,
    SERVO_SLOT,
    TIME_STEP,
    VISION_PERIOD,
    servo_slot,
    vision_slot,
)
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.link.config import Perfect
from drake_tracker.link.link_system import make_link
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram

SUBSYSTEMS = ("film", "vision", "host", "link", "clock")


class Clock(LeafSystem):
    """Replaces plant and servo: it updates at their instants."""

    def __init__(self, time_step):
        super().__init__()
        self.set_name("clock")
        self.DeclarePeriodicUnrestrictedUpdateEvent(time_step, 0.0, lambda context, state: None)
        offset = servo_slot(SERVO_SLOT, time_step)
        self.DeclarePeriodicUnrestrictedUpdateEvent(SERVO_PERIOD, offset, lambda context, state: None)


class ChangeRecorder:
    """A monitor that records the changes of ports: {name: [(time of the change, vector), ...]}.

    A monitor is called before the updates of each instant, so that a change that it sees was made at the instant of the
    previous call.
    """

    def __init__(self, ports):
        self.changes = {name: [] for name in ports}
        self._ports = ports
        self._last_instant = None

    def __call__(self, root):
        for name, port in self._ports.items():
            value = np.array(port.Eval(port.get_system().GetMyContextFromRoot(root)))
            seen = self.changes[name]
            if not seen or not np.array_equal(seen[-1][1], value):
                seen.append((self._last_instant, value))
        self._last_instant = root.get_time()
        return EventStatus.DidNothing()


def run(laboratory, duration, order=SUBSYSTEMS, lag_cycles=LAG_CYCLES, time_step=TIME_STEP, path=None):
    """Returns {port: [(time from which the value was available, vector), ...]}."""
    detectors = {
        side: NormalFlowDetector(window=window.mask(laboratory.whole[side]))
        for side, window in laboratory.windows.items()
    }
    subsystems = {
        "film": laboratory.film(path),
        "vision": VisionDiagram(
            laboratory.cameras, detectors, lag_cycles=lag_cycles, work_volume=laboratory.work_volume
        ),
        "host": EstimatorSystem(
            make_estimator("arc_length", ready_after=0.3), offset=vision_slot(ESTIMATOR_SLOT, time_step)
        ),
        "link": make_link(Perfect(), time_step=time_step),
        "clock": Clock(time_step),
    }
    builder = DiagramBuilder()
    for name in order:
        builder.AddNamedSystem(name, subsystems[name])
    for side in ("left", "right"):
        builder.Connect(
            subsystems["film"].GetOutputPort(f"camera_{side}"), subsystems["vision"].GetInputPort(f"camera_{side}")
        )
    builder.Connect(subsystems["vision"].GetOutputPort("point"), subsystems["host"].GetInputPort("point"))
    builder.Connect(subsystems["host"].GetOutputPort("prediction"), subsystems["link"].GetInputPort("packet"))
    simulator = Simulator(builder.Build())
    recorder = ChangeRecorder(
        {
            "point": subsystems["vision"].GetOutputPort("point"),
            "prediction": subsystems["host"].GetOutputPort("prediction"),
            "delivered": subsystems["link"].GetOutputPort("delivered"),
        }
    )
    simulator.set_monitor(recorder)
    simulator.AdvanceTo(duration)
    return recorder.changes


@pytest.fixture(scope="module")
def changes(small_laboratory):
    """The changes during 2 s of the usual loop."""
    return run(small_laboratory, 2.0)


@pytest.fixture(scope="module")
def usual(small_laboratory):
    """The changes during the first second."""
    return run(small_laboratory, 1.0)


def lags(changes, view):
    """Returns the times [s] from the capture of the middle image until each valid message was available."""
    field = view.get_fields().index
    return np.array([time - value[field("stamp")] for time, value in changes if value[field("valid")]])


def one_value(values, expected):
    return len(values) > 20 and np.ptp(values) < 1e-9 and values[0] == pytest.approx(expected, abs=1e-9)


def test_a_prediction_is_15_cycles_and_one_slot_old_when_it_is_available(changes):
    assert one_value(lags(changes["point"], TrackPoint), 0.250)
    assert one_value(lags(changes["prediction"], Prediction), 0.250 + TIME_STEP / 4)
    assert one_value(lags(changes["delivered"], Prediction), 0.250 + TIME_STEP / 2)
    assert ESTIMATOR_SLOT * TIME_STEP < 0.001


def test_there_is_one_prediction_for_each_image_with_its_stamp(small_laboratory, changes):
    packets = [value for _, value in changes["prediction"] if Prediction(value).valid]
    stamps = np.array([Prediction(packet).stamp for packet in packets])
    assert np.diff(stamps) == pytest.approx(VISION_PERIOD, abs=1e-9)
    assert np.array_equal(np.diff([Prediction(packet).seq for packet in packets]), np.ones(len(packets) - 1))
    # A stamp that is wrong by one cycle would give an error of 2.5 mm.
    settled = stamps > 1.0
    knots = np.array([prediction_knots(packet)[0] for packet in packets])[settled]
    x, y = (knots[:, KNOT_FIELDS.index(name)] for name in ("x", "y"))
    error = np.column_stack([x, y]) - small_laboratory.circle(stamps[settled])[:, :2]
    angle = small_laboratory.speed / small_laboratory.radius * stamps[settled]
    along = np.sum(error * np.column_stack([-np.sin(angle), np.cos(angle)]), axis=1)
    assert abs(along.mean()) < 0.0015


def test_a_motion_is_seen_one_lag_after_it_begins(small_laboratory):
    """The capture time of the middle image follows from the images, not from a stamp."""
    start = 30 * VISION_PERIOD
    changes = run(small_laboratory, 1.2, path=lambda time: small_laboratory.circle(max(time - start, 0.0)))
    first_time, first = next((time, value) for time, value in changes["point"] if TrackPoint(value).valid)
    # When the first image that differs is the newest of three, their middle image still shows the train at rest.
    assert start - 2 * VISION_PERIOD <= TrackPoint(first).stamp <= start + 4 * VISION_PERIOD
    assert first_time - start >= (LAG_CYCLES - 2) * VISION_PERIOD


@pytest.mark.parametrize(
    "order",
    [
        ("clock", "link", "host", "vision", "film"),
        ("link", "film", "host", "clock", "vision"),
        ("host", "vision", "clock", "film", "link"),
    ],
    ids=" ".join,
)
def test_the_order_in_which_subsystems_are_added_has_no_effect(small_laboratory, usual, order):
    other = run(small_laboratory, 1.0, order)
    for name, changes in usual.items():
        assert [time for time, _ in changes] == [time for time, _ in other[name]]
        assert all(np.array_equal(a[1], b[1]) for a, b in zip(changes, other[name], strict=True))
    assert len(lags(usual["delivered"], Prediction)) > 10


@pytest.mark.parametrize("lag_cycles", [3, 30])
def test_another_lag_is_kept_exactly(small_laboratory, lag_cycles):
    changes = run(small_laboratory, 1.5, lag_cycles=lag_cycles)
    assert one_value(lags(changes["prediction"], Prediction), lag_cycles * VISION_PERIOD + TIME_STEP / 4)


def test_slots_scale_with_the_plant_step(small_laboratory):
    fine = TIME_STEP / 2
    changes = run(small_laboratory, 1.2, time_step=fine)
    assert one_value(lags(changes["prediction"], Prediction), 0.250 + fine / 4)
    assert one_value(lags(changes["delivered"], Prediction), 0.250 + LINK_SLOT * fine)
