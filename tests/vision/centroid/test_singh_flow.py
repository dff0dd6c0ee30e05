"""Arithmetic of the experiment with Singh's image flow (benchmarks/methods/singh_method.py)."""

import cv2
import numpy as np
import pytest
from methods.singh_method import Flow, centroid, conservation, moving_probability, neighbourhood
from singh_flow import without_bias

RNG = np.random.default_rng(1990)
INNER = np.s_[12:-12, 12:-12]
SHARPNESS = 1.0 / 800.0


def shifted(image, du, dv):
    M = np.array([[1.0, 0.0, du], [0.0, 1.0, dv]])
    return cv2.warpAffine(image, M, image.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


def three(image, du, dv):
    """I0, I1, I2 of an image that moves by (du, dv) between two of them."""
    return [shifted(image, step * du, step * dv) for step in (-1, 0, 1)]


@pytest.fixture(scope="module")
def texture():
    image = cv2.GaussianBlur(RNG.normal(0.0, 1.0, (60, 70)), (0, 0), 2.0)
    return (100.0 + 40.0 * image / image.std()).astype(np.float32)


@pytest.mark.parametrize("step", [(0.0, 0.0), (1.0, -2.0), (-2.0, 1.0)])
def test_a_translation_is_recovered_with_a_small_covariance(texture, step):
    flow = conservation(three(texture, *step), SHARPNESS)
    for estimate in (flow, neighbourhood(flow)):
        assert np.median(estimate.mean[INNER], axis=(0, 1)) == pytest.approx(step, abs=0.1)
        assert np.median(np.trace(estimate.covariance[INNER], axis1=2, axis2=3)) < 0.1


def test_a_translation_of_half_a_pixel_lies_between_its_neighbours(texture):
    flow = neighbourhood(conservation(three(texture, 0.5, -0.5), SHARPNESS))
    assert np.median(flow.mean[INNER], axis=(0, 1)) == pytest.approx((0.5, -0.5), abs=0.1)


@pytest.mark.parametrize("angle_deg", [0.0, 45.0, 90.0])
def test_along_an_edge_the_velocity_is_unknown(angle_deg):
    """The aperture problem: the long axis of the covariance lies along the edge."""
    normal = np.array([np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))])
    moved = normal.sum()  # of the displacement (1, 1), along the normal
    v, u = np.indices((61, 61)) - 30.0

    def edge(displacement):
        return (100.0 + 60.0 * np.tanh((u * normal[0] + v * normal[1] - displacement) / 1.5)).astype(np.float32)

    flow = conservation([edge(-moved), edge(0.0), edge(moved)], SHARPNESS)
    values, vectors = np.linalg.eigh(flow.covariance[30, 30])
    assert values[1] > 20.0 * values[0] and values[1] > 1.0
    assert abs(vectors[:, 1] @ normal) < 0.1
    assert flow.mean[30, 30] @ normal == pytest.approx(moved, abs=0.1)


def test_without_texture_nothing_is_known():
    flow = conservation([np.full((20, 20), 50.0)] * 3, SHARPNESS)
    assert flow.mean[10, 10] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert flow.covariance[10, 10] == pytest.approx(4.0 * np.eye(2), abs=0.01)


def test_the_probability_of_motion_follows_the_covariance_along_the_velocity():
    mean = np.broadcast_to([1.0, 0.0], (1, 2, 2))
    covariance = np.array([[np.diag([0.01, 4.0]), np.diag([4.0, 0.01])]])
    sure, unsure = moving_probability(Flow(mean, covariance), 0.5)[0]
    assert sure > 0.999
    assert unsure == pytest.approx(0.5987, abs=1e-3)


def test_the_covariance_of_the_centroid_is_that_of_its_samples():
    probability = np.zeros((9, 11))
    probability[2:7, 3:8] = RNG.uniform(0.5, 1.0, (5, 5))
    found = centroid(probability, window=1)
    v, u = np.indices(probability.shape)
    samples = []
    for _ in range(4000):
        member = RNG.uniform(size=probability.shape) < probability
        samples.append([u[member].mean(), v[member].mean()])
    assert found.uv == pytest.approx(np.mean(samples, axis=0), abs=0.03)
    assert found.covariance == pytest.approx(np.cov(np.transpose(samples)), abs=0.005)
    assert centroid(np.zeros((4, 4))) is None


def test_a_bias_by_heading_is_removed_by_the_other_laps():
    headings = [np.array([0.1, 2.0, 0.1, 2.0])] * 3
    bias = np.where(headings[0][:, None] < 1.0, [1.0, -2.0], [-3.0, 0.5])
    left = without_bias([bias, bias, bias + 0.1], headings)
    assert np.abs(left).max() == pytest.approx(0.1)
