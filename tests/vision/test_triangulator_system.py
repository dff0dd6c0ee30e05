import numpy as np
import pytest

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import TrackPoint
from drake_tracker.vision.triangulator_system import TriangulatorSystem

K = np.array([[400.0, 0.0, 127.5], [0.0, 400.0, 127.5], [0.0, 0.0, 1.0]])
P_WQ = np.array([0.1, 0.05, 0.02])
BOX = [[-0.2, -0.2, -0.1], [0.2, 0.2, 0.1]]


def camera(x):
    """A camera 1 m above the origin plane at (x, 0), that looks straight down."""
    X_CW = np.array([[1.0, 0, 0, -x], [0, -1.0, 0, 0], [0, 0, -1.0, 1.0], [0, 0, 0, 1.0]])
    return CameraModel(K, np.zeros(5), X_CW, 256, 256)


LEFT, RIGHT = camera(-0.2), camera(0.2)


def centroid(model, stamp=2.0, valid=1.0, shift=(0.0, 0.0), p_WQ=P_WQ):
    u, v = model.project(p_WQ)[0] + shift
    return np.array([stamp, u, v, 200.0, valid])


def evaluate(left, right, **settings):
    system = TriangulatorSystem(LEFT, RIGHT, **settings)
    context = system.CreateDefaultContext()
    system.GetInputPort("centroid_left").FixValue(context, left)
    system.GetInputPort("centroid_right").FixValue(context, right)
    return TrackPoint(system.GetOutputPort("point").Eval(context).copy())


def test_two_valid_centroids_make_a_point():
    point = evaluate(centroid(LEFT), centroid(RIGHT), work_volume=BOX)
    assert point.valid == 1.0 and point.stamp == 2.0
    assert (point.x, point.y, point.z) == pytest.approx(P_WQ, abs=1e-6)
    assert point.gap == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    "left, right",
    [
        (centroid(LEFT, valid=0.0), centroid(RIGHT)),
        (centroid(LEFT), centroid(RIGHT, valid=0.0)),
        (centroid(LEFT), centroid(RIGHT, stamp=2.0 + 1 / 60)),
        (np.zeros(5), np.zeros(5)),
    ],
)
def test_invalid_when_either_centroid_is_or_stamps_differ(left, right):
    point = evaluate(left, right)
    assert point.valid == 0.0
    assert point.stamp == max(left[0], right[0])
    assert (point.x, point.y, point.z) == (0.0, 0.0, 0.0)


def test_invalid_when_the_rays_pass_too_far_apart():
    # 20 px up in one image at about 1 m is 49 mm.
    apart = centroid(RIGHT, shift=(0.0, 20.0))
    point = evaluate(centroid(LEFT), apart)
    assert point.valid == 0.0
    assert point.gap == pytest.approx(0.049, abs=0.002)
    assert evaluate(centroid(LEFT), apart, max_gap=0.06).valid == 1.0


def test_invalid_outside_the_work_volume():
    for z, valid in ((0.12, 1.0), (0.17, 0.0)):
        p_WQ = [0.0, 0.0, z]
        point = evaluate(centroid(LEFT, p_WQ=p_WQ), centroid(RIGHT, p_WQ=p_WQ), work_volume=BOX, margin=0.05)
        assert point.valid == valid
    with pytest.raises(DrakeTrackerError, match="work volume .* each minimum below its maximum"):
        TriangulatorSystem(LEFT, RIGHT, work_volume=[[0, 0, 0], [1, -1, 1]])


def test_parallel_rays_are_invalid():
    middle = np.array([2.0, 127.5, 127.5, 200.0, 1.0])
    assert evaluate(middle, middle).valid == 0.0


def test_cameras_that_nothing_synchronises_have_a_tolerance():
    early, late = centroid(LEFT, stamp=2.0), centroid(RIGHT, stamp=2.01)
    assert not evaluate(early, late).valid
    point = evaluate(early, late, stamp_tolerance=0.012)
    assert point.valid and point.stamp == pytest.approx(2.005)
