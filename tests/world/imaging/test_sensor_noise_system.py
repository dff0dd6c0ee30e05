import numpy as np
import pytest
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.imaging.sensor_model import SensorNoise, flicker_gain
from drake_tracker.world.imaging.sensor_noise_system import SensorNoiseSystem


def noisy(grey=120, *, time=0.0, width=128, height=96, window=None, noise=2.0, **options):
    system = SensorNoiseSystem(SensorNoise(width=width, height=height, window=window, std=noise, **options))
    context = system.CreateDefaultContext()
    context.SetTime(time)
    image = ImageRgba8U(*(window[2:] if window else (width, height)))
    image.mutable_data[..., :3] = grey
    image.mutable_data[..., 3] = 255
    system.GetInputPort("color_image").FixValue(context, image)
    return system.GetOutputPort("color_image").Eval(context).data.astype(int)


def test_noise_is_grey_white_and_of_the_asked_size():
    image = noisy(noise=4.0)
    noise = image[..., 0] - 120.0
    assert abs(noise.mean()) < 4.0 * 4.0 / np.sqrt(noise.size)
    assert noise.std() == pytest.approx(4.0, rel=0.03)
    assert (image[..., :3] == image[..., :1]).all() and (image[..., 3] == 255).all()
    neighbours = np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1]
    assert abs(neighbours) < 0.04


def test_the_period_sets_the_frame():
    first = noisy(time=VISION_PERIOD)
    np.testing.assert_array_equal(first, noisy(time=0.1, period=0.1))
    assert np.any(first != noisy(time=0.1))


def test_noise_depends_on_frame_camera_and_seed_alone():
    reference = noisy(time=7 * VISION_PERIOD)
    np.testing.assert_array_equal(reference, noisy(time=7 * VISION_PERIOD + 1e-9))
    others = (
        noisy(time=8 * VISION_PERIOD),
        noisy(time=7 * VISION_PERIOD, camera_index=1),
        noisy(time=7 * VISION_PERIOD, seed=1),
    )
    for other in others:
        assert abs(np.corrcoef(reference[..., 0].ravel(), other[..., 0].ravel())[0, 1]) < 0.04


def test_noise_saturates():
    dark, bright = noisy(0, noise=20.0)[..., 0], noisy(255, noise=20.0)[..., 0]
    assert dark.min() == 0 and 20 < dark.max() < 150
    assert bright.max() == 255 and 105 < bright.min() < 235


def test_a_windows_noise_is_that_of_the_full_image():
    full = noisy(time=0.5)
    part = noisy(time=0.5, window=(9, 14, 50, 31))
    np.testing.assert_array_equal(part, full[14:45, 9:59])


def test_flicker_multiplies_the_light():
    time = 1.0 / 400.0
    assert flicker_gain(time, 0.05, 100.0) == pytest.approx(1.05)
    image = noisy(100, time=time, noise=0.0, flicker=0.05)
    assert (image[..., :3] == 105).all() and (image[..., 3] == 255).all()
    assert (noisy(100, time=3.0 * time, noise=0.0, flicker=0.05)[..., :3] == 95).all()


def test_flicker_of_60_hz_mains_hides_from_60_hz_images():
    gains = [flicker_gain(k * VISION_PERIOD, 0.05, 120.0) for k in range(50)]
    np.testing.assert_allclose(gains, 1.0, atol=1e-9)
    gains = [flicker_gain(k * VISION_PERIOD, 0.05, 100.0) for k in range(50)]
    assert np.std(gains) > 0.03


def test_readers_at_one_instant_share_one_evaluation():
    system = SensorNoiseSystem(SensorNoise(width=8, height=8, std=2.0))
    context = system.CreateDefaultContext()
    system.GetInputPort("color_image").FixValue(context, ImageRgba8U(8, 8))
    port = system.GetOutputPort("color_image")
    first = port.Eval(context).data
    assert np.shares_memory(first, port.Eval(context).data)
    assert not first.flags.writeable
    # Nothing but the Context is remembered: back at an earlier instant, the earlier image comes back.
    before = first.copy()
    context.SetTime(1.0)
    assert (port.Eval(context).data != before).any()
    context.SetTime(0.0)
    np.testing.assert_array_equal(port.Eval(context).data, before)
