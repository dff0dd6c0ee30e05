"""Faults of measured vision: what they do to the points."""

import numpy as np
import pytest
from faulty_runs import CAMERAS, make
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_tracker.core.messages import TrackPoint, message_size
from drake_tracker.faults import config
from drake_tracker.faults.point_faults_system import PointFaultsSystem
from drake_tracker.tasks.train.scenario import WORK_VOLUME

TRAIN = (0.60, 0.15, 0.485)


def point_with(faults, time, p_WQ=TRAIN):
    """Returns the point at a time with faults; the train stands at ``p_WQ``, None is a point that is invalid."""
    given = TrackPoint(np.zeros(message_size(TrackPoint)))
    given.stamp = time
    if p_WQ is not None:
        given.x, given.y, given.z = p_WQ
        given.valid = 1.0
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource(given[:]))
    system = builder.AddSystem(PointFaultsSystem([make(item) for item in faults], CAMERAS, WORK_VOLUME))
    builder.Connect(source.get_output_port(), system.get_input_port())
    builder.ExportOutput(system.get_output_port(), "point")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    context.SetTime(time)
    return given, TrackPoint(diagram.get_output_port().Eval(context))


def place(point):
    return np.array([point.x, point.y, point.z])


@pytest.mark.parametrize("time", [1.0, 6.0, 0.0])
@pytest.mark.parametrize("p_WQ", [TRAIN, None])
def test_outside_of_its_time_a_fault_changes_no_bit(time, p_WQ):
    faults = [config.CameraDark(at=2.0, duration=4.0), config.CameraKnocked(at=2.0, duration=4.0)]
    given, point = point_with(faults, time, p_WQ)
    assert np.array_equal(point[:], given[:])


def test_one_dark_camera_leaves_no_point():
    _, point = point_with([config.CameraDark(camera="left", at=2.0)], 3.0)
    assert (point.valid, point.stamp, point.x) == (0.0, 3.0, 0.0)


def test_a_knocked_camera_and_a_wrong_calibration_shift_the_point_and_open_a_gap():
    for fault in (config.CameraKnocked(camera="right"), config.CalibrationWrong(angle_deg=1.0, distance=-0.01)):
        _, point = point_with([fault], 3.0)
        assert point.valid and 0.015 < np.linalg.norm(place(point) - TRAIN) < 0.05
        assert point.gap > 0.005


def test_rays_that_do_not_meet_and_points_outside_of_the_work_volume_are_invalid():
    tilted = config.CameraKnocked(camera="right", angle_deg=3.0, direction_deg=90.0)
    _, point = point_with([tilted], 3.0)
    assert not point.valid and point.gap > 0.03
    _, point = point_with([config.CameraKnocked(camera="both", angle_deg=8.0)], 3.0)
    assert not point.valid


def test_a_knock_that_the_calibration_knows_does_no_harm():
    """The model of the camera is turned as the camera is: both cancel."""
    pan = config.CameraKnocked(camera="right", angle_deg=1.0)
    error = [
        np.linalg.norm(place(point_with([pan, config.CalibrationWrong(angle_deg=angle)], 3.0)[1]) - TRAIN)
        for angle in (-1.0, 0.0, 1.0)
    ]
    assert min(error) == error[0] < 0.3 * error[1]


def test_a_second_mover_is_seen_where_the_train_is_not():
    fault = make(config.SecondMover(at=0.0))
    _, point = point_with([config.SecondMover(at=0.0)], 4.0, None)
    assert point.valid and place(point) == pytest.approx([0.56, fault.slide(4.0)[0], 0.475], abs=1e-6)
