import itertools

import pytest

from drake_tracker.core import timing
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import (
    ESTIMATOR_SLOT,
    GRASP_SLOT,
    GUARD_SLOT,
    IK_SLOT,
    LAG_CYCLES,
    LIMITER_SLOT,
    LINK_SLOT,
    PROJECTOR_SLOT,
    REFLEX_SLOT,
    SERVO_PERIOD,
    SERVO_SLOT,
    TIME_STEP,
    TRANSFORM_SLOT,
    VISION_PERIOD,
    WRIST_SLOT,
    delay_cycles,
    lag_of_throughput,
    servo_slot,
    steps_in,
    vision_slot,
)

SLOTS = {name: value for name, value in vars(timing).items() if name.endswith("_SLOT")}


def test_the_papers_numbers():
    assert pytest.approx(1 / 60) == VISION_PERIOD
    assert pytest.approx(0.25) == LAG_CYCLES * VISION_PERIOD
    assert SERVO_PERIOD == 0.030


@pytest.mark.parametrize(
    "period, time_step, steps",
    [
        (VISION_PERIOD, TIME_STEP, 5),
        (SERVO_PERIOD, TIME_STEP, 9),
        (LAG_CYCLES * VISION_PERIOD, TIME_STEP, 75),
        (VISION_PERIOD, 1 / 600, 10),
        (SERVO_PERIOD, 1 / 600, 18),
        (0.005, 1 / 600, 3),
    ],
)
def test_every_period_is_a_whole_number_of_plant_steps(period, time_step, steps):
    assert steps_in(period, time_step) == steps


@pytest.mark.parametrize("time_step", [0.001, 0.002, 1 / 450, 0.05])
def test_a_plant_step_that_does_not_divide_the_periods_is_rejected(time_step):
    periods = (VISION_PERIOD, SERVO_PERIOD)
    with pytest.raises(DrakeTrackerError, match="whole number of plant steps"):
        [steps_in(period, time_step) for period in periods]


def test_slots_lie_within_a_plant_step_in_the_order_of_the_data():
    order = [PROJECTOR_SLOT, WRIST_SLOT, ESTIMATOR_SLOT, LINK_SLOT, GUARD_SLOT, REFLEX_SLOT]
    order += [SERVO_SLOT, GRASP_SLOT, TRANSFORM_SLOT, IK_SLOT, LIMITER_SLOT]
    assert order[0] > 0.0 and order[-1] < 1.0
    assert order == sorted(set(order))
    assert set(SLOTS.values()) == set(order), "this test does not list a slot"


@pytest.mark.parametrize("time_step", [TIME_STEP, TIME_STEP / 2])
def test_no_two_subsystems_update_at_the_same_instant(time_step):
    """Instants are counted in parts of 1/32 of a plant step, over the least common multiple of 1/60 s and 30 ms."""
    vision, servo = (steps_in(period, time_step) for period in (VISION_PERIOD, SERVO_PERIOD))
    together = vision * servo * 32

    def instants(offset, period):
        first = offset / time_step * 32
        assert first == pytest.approx(round(first), abs=1e-9)
        return set(range(round(first), together, period * 32))

    updates = [instants(0.0, 1)]  # the plant; vision is in step with it
    updates += [instants(REFLEX_SLOT * time_step, 1)]
    updates += [
        instants(vision_slot(slot, time_step), vision)
        for slot in (PROJECTOR_SLOT, ESTIMATOR_SLOT, LINK_SLOT, GUARD_SLOT)
    ]
    updates += [
        instants(servo_slot(slot, time_step), servo)
        for slot in (SERVO_SLOT, GRASP_SLOT, TRANSFORM_SLOT, IK_SLOT, LIMITER_SLOT)
    ]
    assert all(a.isdisjoint(b) for a, b in itertools.combinations(updates, 2))


def test_the_servo_works_in_the_last_step_of_its_period():
    # The interpolator samples at whole periods and reads a set-point that is a fraction of a plant step old.
    assert SERVO_PERIOD - servo_slot(SERVO_SLOT) == pytest.approx((1 - SERVO_SLOT) * TIME_STEP)
    assert SERVO_PERIOD - servo_slot(IK_SLOT, TIME_STEP / 2) == pytest.approx((1 - IK_SLOT) * TIME_STEP / 2)


def test_the_delay_line_adds_the_rest_of_the_lag():
    assert delay_cycles(15, 1) == 14  # consecutive images
    assert delay_cycles(15, 2) == 13  # images every other cycle
    assert delay_cycles(30, 2) == 28
    assert delay_cycles(2, 2) == 0


@pytest.mark.parametrize("lag_cycles, newest", [(1, 2), (15, 0.5), (14.5, 1)])
def test_a_lag_that_is_not_whole_or_too_short_is_rejected(lag_cycles, newest):
    with pytest.raises(DrakeTrackerError, match="must be a whole number, 0 or more"):
        delay_cycles(lag_cycles, newest)


@pytest.mark.parametrize(
    ("first_image_age", "stamp_age", "lag", "delay"),
    [(2, 1.0, 5.0, 4), (1, 0.5, 5.5, 5), (4, 2, 4, 2), (0, 0, 6, 6)],
    ids=["interlaced difference", "difference", "normal flow", "static image"],
)
def test_a_throughput_counts_from_the_first_image(first_image_age, stamp_age, lag, delay):
    """Nashman and Chaconas 1990, section 4: 100.2 ms; half a cycle between stamp and image leaves the delay whole."""
    assert pytest.approx(0.1002, rel=0.01) == 6 * VISION_PERIOD
    assert lag_of_throughput(6, first_image_age, stamp_age) == lag
    assert delay_cycles(lag, stamp_age) == delay
