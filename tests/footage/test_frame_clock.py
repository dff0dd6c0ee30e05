import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.frame_clock import FrameClock, fit_clock

PERIOD = 1.0 / 30.0


def ticks(clock, times):
    found, previous = [], -1
    for time in times:
        tick = clock.tick(time, previous)
        found.append(tick)
        previous = previous if tick is None else tick
    return found


def test_times_rounded_to_a_millisecond_and_dropped_images_do_not_put_it_off():
    kept = np.delete(np.arange(3000), [5, 6, 7, 1200, 2999])
    clock = fit_clock(np.round(kept * PERIOD, 3))
    assert clock.period == pytest.approx(PERIOD, rel=1e-6)
    assert ticks(clock, np.round(kept * PERIOD, 3)) == kept.tolist()


def test_jitter_drops_nothing():
    rng = np.random.default_rng(0)
    times = np.arange(2000) * PERIOD + rng.uniform(-0.3, 0.3, 2000) * PERIOD
    clock = fit_clock(times - times[0])
    assert clock.period == pytest.approx(PERIOD, rel=1e-4)
    assert ticks(clock, times - times[0]) == list(range(2000))


def test_an_image_too_early_takes_the_next_tick_and_a_surplus_is_left_out():
    clock = FrameClock(1.0)
    assert ticks(clock, [0.0, 0.6, 1.2, 3.0]) == [0, 1, 2, 3]
    assert ticks(clock, [0.0, 0.1, 0.2, 1.0, 1.9]) == [0, 1, None, 2, 3]


def test_few_images_are_refused():
    with pytest.raises(DrakeTrackerError, match="a.mp4: there are 7 images; at least 8"):
        fit_clock(np.arange(7.0), "a.mp4")
