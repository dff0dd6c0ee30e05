import numpy as np
import pytest

from drake_tracker.core.messages import EncoderReading, message_size
from drake_tracker.dispatch.encoder_history import KEPT, SLOPE, EncoderHistory


def reading(time, distance, valid=1.0):
    found = EncoderReading(np.zeros(message_size(EncoderReading)))
    found.time, found.distance, found.valid = time, distance, valid
    return found


def history(times, distance):
    found = EncoderHistory()
    for time in times:
        found = found.extended(reading(time, distance(time)))
    return found


def test_it_tells_the_travel_between_two_times_and_the_speed_at_the_second():
    found = history(np.arange(0.0, 0.5, 1 / 60), lambda t: 0.2 * t * t)
    travel = found.travel(0.1, 0.4)
    assert travel.distance == pytest.approx(0.2 * (0.16 - 0.01), abs=2e-5)
    assert travel.speed == pytest.approx(0.4 * (0.4 - 0.5 * SLOPE), rel=0.02)


def test_without_measurements_of_the_time_it_says_nothing():
    assert EncoderHistory().travel(0.0, 1.0) is None
    found = history([1.0, 1.1], lambda t: t)
    assert found.travel(0.9, 1.1) is None
    assert found.travel(1.0, 1.1) is not None


def test_the_speed_just_after_the_start_uses_what_there_is():
    found = history([0.0, 0.01], lambda t: 0.15 * t)
    assert found.travel(0.0, 0.01).speed == pytest.approx(0.15)


@pytest.mark.parametrize(
    "wrong",
    [reading(1.2, 0.1, valid=0.0), reading(1.2, np.nan), reading(0.9, 0.1), reading(1.1, 0.1)],
    ids=["invalid", "not finite", "older", "repeated"],
)
def test_a_measurement_that_cannot_be_right_is_not_used(wrong):
    found = history([1.0, 1.1], lambda t: 0.0)
    assert found.extended(wrong) is found


@pytest.mark.parametrize("jump", [0.5, -0.5])
def test_after_a_jump_nothing_is_known_of_the_travel_across_it(jump):
    """A reading that was ignored for a while would count as a belt that stands, and then runs at 2 m/s."""
    times = np.arange(0.0, 1.0, 1 / 60)
    for count in range(30, 50):
        now = times[count - 1]
        found = history(times[:count], lambda t: 0.15 * t + (jump if t > 0.55 else 0.0))
        travel = found.travel(now - 0.1, now)
        assert (travel is None) == (0.55 < now < 0.66)
        if travel is not None:
            assert travel.distance == pytest.approx(0.015) and travel.speed == pytest.approx(0.15)


def test_a_silent_encoder_does_not_tell_that_the_belt_stands():
    found = history(np.arange(0.0, 0.5, 1 / 60), lambda t: 0.15 * t)
    assert found.travel(0.4, 0.5).speed > 0.0
    assert found.travel(0.4, 0.6) is None


def test_only_the_last_second_is_kept_and_earlier_histories_do_not_change():
    early = history([0.0], lambda t: 0.1 * t)
    found = early
    for time in np.arange(1, 200) / 60:
        found = found.extended(reading(time, 0.1 * time))
    assert len(early.readings) == 1
    assert found.readings[0, 0] >= found.readings[-1, 0] - KEPT - 1e-9 and len(found.readings) == 61
    with pytest.raises(ValueError):
        found.readings[0, 0] = 0.0
