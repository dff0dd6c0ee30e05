import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import VectorLogSink
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_FIELDS,
    TARGET_STRIDE,
    TRACK_FIELDS,
    TrackPoint,
    TrackPoints,
    WristPoint,
    message_rows,
    message_size,
    pack_prediction,
)
from drake_tracker.vision.hand.wrist_measurement import FixedPoint, WristMeasurement, WristReason, nothing
from drake_tracker.vision.hand.wrist_messages import FIXED, WRIST, expectation, fixed_point, fuse, fused
from drake_tracker.vision.hand.wrist_view_system import WristViewSystem
from drake_tracker.vision.silhouettes.target import Reason

PERIOD = 1.0 / 60.0
SEEN_AT = np.array([0.5, 0.1, 0.48])
COVARIANCE = np.diag([4e-6, 1e-6, 9e-6])
MEASURED = WristMeasurement(WristReason.VALID, SEEN_AT + [0.004, 0.0, 0.0], COVARIANCE, 0.9)


def tracks_at(stamp, seen=None, number=7):
    """A `TrackPoints` vector with one track, the target, and the `TrackPoint` of the fixed cameras."""
    message, point = np.zeros(message_size(TrackPoints)), np.zeros(message_size(TrackPoint))
    header = TrackPoints(message)
    header.stamp, header.target, header.valid, header.reason = stamp, number, 1.0, Reason.OCCLUDED
    row = message_rows(message, TRACK_FIELDS)[0]
    values = {"number": number, "state": 1, "seen": stamp if seen is None else seen, "size": 0.12}
    values |= dict(zip("xyz", SEEN_AT)) | {"xx": 4e-6, "yy": 1e-6, "zz": 9e-6}
    for name, value in values.items():
        row[TRACK_FIELDS.index(name)] = value
    if seen is None:
        header.reason = Reason.NONE
        point[:] = [stamp, *SEEN_AT, 0.001, 1.0]
    return message, point


def packet_at(stamp, number=7):
    knots = np.zeros((KNOT_COUNT, len(KNOT_FIELDS)))
    knots[:, :3] = SEEN_AT
    return pack_prediction(stamp, number * TARGET_STRIDE + 3, knots)


def test_both_measurements_are_fused_by_their_covariances():
    tracks, point = tracks_at(1.0)
    fixed = fixed_point(message_rows(tracks, TRACK_FIELDS)[0], 1.0)
    new_tracks, new_point, source = fused(tracks, point, 7, fixed, MEASURED)
    p_WQ, covariance = fuse([(MEASURED.p_WQ, COVARIANCE), (SEEN_AT, COVARIANCE)])
    assert source == FIXED + WRIST
    assert TrackPoint(new_point)[1:4] == pytest.approx(p_WQ) and p_WQ[0] == pytest.approx(SEEN_AT[0] + 0.002)
    row = message_rows(new_tracks, TRACK_FIELDS)[0]
    assert row[TRACK_FIELDS.index("xx")] == pytest.approx(covariance[0, 0]) == pytest.approx(2e-6)


def test_the_camera_on_the_hand_alone_gives_a_point_of_the_target():
    tracks, point = tracks_at(1.0, seen=0.5)
    assert fixed_point(message_rows(tracks, TRACK_FIELDS)[0], 1.0) is None
    new_tracks, new_point, source = fused(tracks, point, 7, None, MEASURED)
    assert source == WRIST and TrackPoint(new_point).valid
    assert TrackPoints(new_tracks).reason == Reason.NONE
    assert message_rows(new_tracks, TRACK_FIELDS)[0, TRACK_FIELDS.index("seen")] == 1.0


@pytest.mark.parametrize("reason", [WristReason.DARK, WristReason.POOR_MATCH])
def test_without_it_the_fixed_cameras_carry_on(reason):
    tracks, point = tracks_at(1.0)
    fixed = FixedPoint(SEEN_AT, COVARIANCE, 0.12)
    new_tracks, new_point, source = fused(tracks, point, 7, fixed, nothing(reason))
    assert np.array_equal(new_tracks, tracks) and np.array_equal(new_point, point) and source == FIXED


def test_only_a_packet_about_the_target_predicts_it():
    assert expectation(packet_at(1.0), 7, 1.1).p_WQ == pytest.approx(SEEN_AT)
    assert expectation(packet_at(1.0), 8, 1.1) is None
    assert expectation(packet_at(1.0), 7, 9.0) is None
    assert expectation(None, 7, 1.1) is None


class Hand:
    """A hand whose camera is its first joint."""

    num_joints = 2

    class camera:
        distortion = np.zeros(5)

    def at(self, q):
        return q[0]

    def scene(self, width):
        return np.ones((4, 4), np.float32)


class View:
    """Notes with what it was called."""

    def __init__(self):
        self.calls = []

    def measure(self, appearance, image, seen, camera, expected, fixed):
        self.calls.append((float(image[0, 0]), camera, fixed is not None))
        return appearance, MEASURED


def run(latency=0, lag=5, cycles=12, width=0.08, image=True, update_cycles=1):
    """Runs the System with images and joints that count the cycles; returns the view and the logged `WristPoint`."""
    view = View()
    late = {"lag_cycles": lag, "image_latency": latency, "update_cycles": update_cycles}
    system = WristViewSystem(view, Hand(), held_width=0.042, offset=PERIOD / 8, **late)
    builder = DiagramBuilder()
    builder.AddSystem(system)
    log = builder.AddSystem(VectorLogSink(message_size(WristPoint), PERIOD))
    builder.Connect(system.GetOutputPort("wrist"), log.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = system.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    system.GetInputPort("prediction").FixValue(context, packet_at(0.0))
    for k in range(cycles):
        picture = ImageRgba8U(4, 4)
        picture.mutable_data[:] = max(k - latency, 0)
        if image:
            system.GetInputPort("camera_wrist").FixValue(context, Value(picture))
        system.GetInputPort("arm_state").FixValue(context, [k, 0.0, 0.0, 0.0])
        system.GetInputPort("jaws").FixValue(context, [width, 0.0, 0.0])
        stamp = (k - lag) * PERIOD
        tracks, point = (
            tracks_at(stamp) if stamp > -1e-9 else (np.zeros(n) for n in map(message_size, (TrackPoints, TrackPoint)))
        )
        system.GetInputPort("tracks").FixValue(context, tracks)
        system.GetInputPort("fixed_point").FixValue(context, point)
        simulator.AdvanceTo((k + 0.9) * PERIOD)
    wrist = system.GetOutputPort("wrist").Eval(system.GetMyContextFromRoot(simulator.get_context()))
    return view, WristPoint(wrist)


@pytest.mark.parametrize("latency", [0, 3, 5])
def test_image_joints_and_tracks_of_one_stamp_meet(latency):
    view, wrist = run(latency)
    assert [call[:2] for call in view.calls] == [(float(k), float(k)) for k in range(1, 7)]
    assert wrist.stamp == pytest.approx(6 * PERIOD) and wrist.source == FIXED + WRIST and wrist.valid


@pytest.mark.parametrize("latency", [0, 3])
def test_only_every_second_image_is_looked_at(latency):
    view, wrist = run(latency, update_cycles=2)
    assert [call[0] for call in view.calls] == [2.0, 4.0, 6.0] and wrist.valid
    assert run(latency, update_cycles=2, cycles=11)[1].reason == WristReason.NO_IMAGE


def test_closed_jaws_and_missing_images_give_the_reason():
    assert run(width=0.04)[1].reason == WristReason.JAWS_CLOSED
    assert run(image=False)[1].reason == WristReason.NO_IMAGE


def test_a_lag_shorter_than_the_latency_is_refused():
    with pytest.raises(DrakeTrackerError, match="latency"):
        WristViewSystem(View(), Hand(), held_width=0.042, lag_cycles=3, image_latency=4)
