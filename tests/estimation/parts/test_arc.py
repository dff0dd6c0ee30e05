import numpy as np
import pytest

from drake_tracker.estimation.parts.arc import delta_power, delta_transform


@pytest.mark.parametrize("phi", [0.3, -0.3, 1e-12, 0.0])
def test_power_is_the_repeated_product(phi):
    transform = delta_transform(0.1, phi, 0.0)
    product = np.eye(4)
    for n in range(1, 12):
        product = product @ transform
        position, turn = delta_power(0.1, phi, n)
        np.testing.assert_allclose([position.real, position.imag], product[:2, 3], atol=1e-12)
        assert turn == pytest.approx(n * phi)


def test_fractional_and_negative_powers_stay_on_the_circle():
    # Chord frame of the point (R, 0) of a circle about the origin, reached by a step of angle phi.
    radius, phi = 0.12, 0.2
    chord_heading = np.pi / 2 - phi / 2
    n = np.array([-3.0, -0.4, 0.0, 0.5, 7.3])
    position, turn = delta_power(2.0 * radius * np.sin(phi / 2), phi, n)
    points = radius + position * np.exp(1j * chord_heading)
    np.testing.assert_allclose(points, radius * np.exp(1j * n * phi), atol=1e-12)
    np.testing.assert_allclose(turn, n * phi)


def test_transform_is_rotation_then_translation_with_climb():
    transform = delta_transform(0.2, 0.5, 0.03)
    rotation = transform[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(transform[:3, 3], [0.2 * np.cos(0.5), 0.2 * np.sin(0.5), 0.03])
