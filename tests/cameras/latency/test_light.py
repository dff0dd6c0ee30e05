"""The latency by a light that is switched."""

import time

import numpy as np
import pytest

from drake_tracker.cameras.latency.light import LONGEST, SHORTEST, SwitchedLight, read_switches, write_switches
from drake_tracker.cameras.latency.measurement import measure_by_light
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage

EPOCH = 1.7e9


def switched(seed, duration=18.0):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(SHORTEST, LONGEST, int(duration / SHORTEST)))
    times = times[times < duration]
    return [(EPOCH + time, k % 2) for k, time in enumerate(times.tolist(), 1)]


def film(switches, latency, epoch=EPOCH, rate=29.97, exposure=0.02, seed=0, visible=True):
    """A small light among noise; each image is exposed around its stamp less the latency."""
    rng = np.random.default_rng(seed)
    times, states = np.array(switches).T
    stamps = np.arange(0.0, times[-1] - EPOCH + 0.5, 1.0 / rate)
    stamps = stamps + rng.normal(0.0, 0.0005, len(stamps))
    stamps -= stamps[0]
    fine = np.linspace(-0.5, 0.5, 41) * exposure
    images = []
    for stamp in stamps:
        place = np.searchsorted(times, EPOCH + stamp - latency + fine, "right") - 1
        share = np.where(place >= 0, states[np.maximum(place, 0)], 0).mean()
        image = rng.normal(60.0, 4.0, (120, 160))
        if visible:
            image[40:52, 100:112] += 120.0 * share
        images.append(np.repeat(np.clip(image, 0, 255).astype(np.uint8)[..., None], 3, axis=2))
    return Footage("lamp", (160, 120), lambda: zip(stamps.tolist(), images), stamps, epoch)


@pytest.mark.parametrize("latency", [0.012, 0.0871, 0.65])
def test_the_latency_by_a_light_is_within_two_milliseconds(latency):
    switches = switched(21)
    measured = measure_by_light(film(switches, latency), lambda: switches)
    assert measured.absolute and measured.refresh is None
    assert abs(measured.latency.seconds - latency) < 0.002
    assert measured.latency.images > 0.8 * len(switches)


def test_a_recording_with_a_clock_of_its_own_is_found_in_the_times_of_the_light():
    switches = switched(22)
    measured = measure_by_light(film(switches, 0.05, epoch=None), lambda: switches)
    assert not measured.absolute
    assert abs(measured.latency.seconds - (0.05 + switches[0][0] - EPOCH)) < 0.002


def test_a_light_out_of_view_is_refused():
    switches = switched(23)
    with pytest.raises(DrakeTrackerError, match="lamp: no part of the images follows the light"):
        measure_by_light(film(switches, 0.05, visible=False), lambda: switches)


def test_the_times_of_a_light_are_kept(tmp_path):
    switches = switched(24)
    write_switches(tmp_path / "times.csv", switches)
    times, states = read_switches(tmp_path / "times.csv")
    assert np.allclose(times, [time for time, _ in switches], atol=1e-6)
    assert states.tolist() == [on for _, on in switches]


@pytest.mark.parametrize("text", ["", "time,on\n1,1\n", "time,on\n2,1\n1,0\n", "time,on\n1,5\n2,0\n", "a,b\nx,y\n"])
def test_wrong_times_of_a_light_are_refused(tmp_path, text):
    (tmp_path / "times.csv").write_text(text)
    with pytest.raises(DrakeTrackerError, match="times of the light"):
        read_switches(tmp_path / "times.csv")


def test_the_light_is_switched_and_off_at_the_end(tmp_path):
    lamp = tmp_path / "brightness"
    lamp.write_text("1\n")
    with SwitchedLight(lamp) as light:
        while len(light.switches) < 3:
            time.sleep(0.01)
    assert lamp.read_text() == "0\n"
    times, states = np.array(light.switches).T
    assert (np.diff(times) > 0.0).all() and (np.abs(np.diff(states)) == 1).all() and states[-1] == 0


def test_a_light_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(DrakeTrackerError, match="--light .*missing: cannot be written: No such file"):
        SwitchedLight(tmp_path / "missing")
