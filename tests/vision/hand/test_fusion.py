import numpy as np
import pytest

from drake_tracker.vision.hand.wrist_messages import fuse

ONE, TWO = np.array([0.0, 0.0]), np.array([1.0, 1.0])


def test_a_single_measurement_is_unchanged():
    point, covariance = fuse([(TWO, 2.0 * np.eye(2))])
    assert np.array_equal(point, TWO) and np.array_equal(covariance, 2.0 * np.eye(2))


def test_each_axis_has_the_weight_of_its_precision():
    point, covariance = fuse([(ONE, np.diag([1.0, 4.0])), (TWO, np.diag([3.0, 1.0]))])
    assert point == pytest.approx([0.25, 0.8])
    assert covariance == pytest.approx(np.diag([0.75, 0.8]))


def test_fusion_equals_kalman_updates_one_after_the_other():
    rng = np.random.default_rng(0)
    measurements = []
    for _ in range(3):
        root = rng.normal(size=(3, 3))
        measurements.append((rng.normal(size=3), root @ root.T + 0.1 * np.eye(3)))
    mean, P = measurements[0]
    for z, R in measurements[1:]:
        gain = P @ np.linalg.inv(P + R)
        mean, P = mean + gain @ (z - mean), (np.eye(3) - gain) @ P
    point, covariance = fuse(measurements)
    assert point == pytest.approx(mean) and covariance == pytest.approx(P)
