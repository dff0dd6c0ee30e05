import math

import numpy as np
import pytest
from belts import CELLS, MODEL, START, part, random_parts
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_tracker.dispatch import CycleModel, CycleTime, FreeHand, PickWindow
from drake_tracker.dispatch.cycle_time import meeting_time, motion_time

CYCLE = MODEL.cycle
FOLLOW = CYCLE.descent + CYCLE.close
PLACE = CYCLE.lift + CYCLE.lower + CYCLE.release + CYCLE.rise


@pytest.mark.parametrize("distance", [0.0, 0.001, 0.1, 0.3])
def test_a_motion_covers_its_distance_in_its_time(distance):
    speed, acceleration = 0.6, 2.5
    times = np.linspace(0.0, motion_time(distance, speed, acceleration), 20001)
    velocity = np.minimum(speed, acceleration * np.minimum(times, times[-1] - times))
    assert np.trapezoid(velocity, times) == pytest.approx(distance, abs=1e-7)


@settings(max_examples=300, deadline=None)
@given(
    across=st.floats(-0.5, 0.5),
    along=st.floats(-1.0, 1.0),
    speed=st.floats(0.1, 1.5),
    share=st.floats(0.0, 0.95),
    acceleration=st.floats(0.3, 20.0),
    earliest=st.sampled_from([0.0, 0.1, 1.0]),
)
@example(across=0.0, along=-4.449288474488816e-11, speed=1.0, share=0.5, acceleration=1.0, earliest=0.0)
def test_the_hand_meets_a_part_as_early_as_a_search_in_small_steps_finds(
    across, along, speed, share, acceleration, earliest
):
    v = share * speed
    met = meeting_time(across, along, v, speed, acceleration, earliest)

    def slack(t):
        return t - motion_time(math.hypot(across, along + v * t), speed, acceleration)

    assert met >= earliest
    assert slack(met) >= -1e-6
    if met > earliest:
        times = np.linspace(earliest, met, 500)[:-1]
        assert max(map(slack, times[times < met - 1e-6]), default=-1.0) <= 1e-9


def test_a_part_that_passes_a_slow_hand_is_met_as_it_passes():
    """The equation has three roots: the part comes towards the hand, passes it, and is caught up with later."""
    along, v, acceleration = -0.03, 0.15, 0.5

    def slack(t):
        return t - motion_time(abs(along + v * t), 0.6, acceleration)

    met = meeting_time(0.0, along, v, 0.6, acceleration)
    assert slack(met) == pytest.approx(0.0, abs=1e-9) and along + v * met < 0.0
    assert min(map(slack, np.linspace(met, 10.0 * met, 1000))) < -0.01


def test_a_pick_on_a_belt_at_rest_takes_the_motion_the_descent_and_the_closing():
    pick = MODEL.pick_time(START, part(1, x=0.68, y=0.0, v=0.0), now=5.0)
    assert pick == pytest.approx(5.0 + motion_time(0.3, CYCLE.approach_speed, CYCLE.approach_acceleration) + FOLLOW)


def test_a_part_is_not_picked_before_the_window_nor_after_it():
    upstream = part(1, y=-0.60, v=0.1)
    assert MODEL.pick_time(START, upstream, 0.0) == pytest.approx(2.0)
    assert MODEL.pick_time(START, part(1, y=0.41, v=0.1), 0.0) is None
    assert MODEL.pick_time(START, part(1, y=0.43, v=0.0), 0.0) is None
    assert MODEL.pick_time(START, part(1, y=-0.41, v=0.0), 0.0) is None


@pytest.mark.parametrize("seed", range(20))
def test_every_pick_is_in_the_window_and_after_the_hand_is_free(seed):
    for candidate in random_parts(seed, 20, first=-1.0, last=0.4):
        hand = FreeHand(0.4, 0.3, 2.5)
        pick = MODEL.pick_time(hand, candidate, now=1.0)
        if pick is not None:
            y = candidate.y + candidate.v * (pick - 1.0)
            assert -0.40 - 1e-9 <= y <= 0.42 + 1e-9
            assert pick >= 2.5 + FOLLOW


@pytest.mark.parametrize("seed", range(20))
def test_a_hand_that_is_free_earlier_never_picks_later(seed):
    for candidate in random_parts(seed, 10):
        times = [
            MODEL.pick_time(FreeHand(0.4, -0.2, free), candidate, 0.0) or math.inf for free in np.linspace(0, 4, 41)
        ]
        assert np.all(np.diff([t for t in times if t < math.inf]) >= -1e-9)
        assert sorted(times) == pytest.approx(times)


def test_a_part_as_fast_as_the_hand_is_not_picked():
    fast = part(1, y=-1.4, v=1.6)
    assert MODEL.pick_time(START, fast, 0.0) is None
    assert CycleModel(CycleTime(approach_speed=4.0, approach_acceleration=40.0), PickWindow()).pick_time(
        START, fast, 0.0
    )


def test_the_hand_is_free_over_its_cell_after_the_phases_of_placing():
    candidate = part(1, x=0.60, y=-0.1, v=0.1)
    pick, after = MODEL.after(START, candidate, CELLS[0], 0.0)
    distance = math.dist((0.60, -0.1 + 0.1 * pick), (CELLS[0].x, CELLS[0].y))
    assert after.free_at == pytest.approx(
        pick + PLACE + motion_time(distance, CYCLE.carry_speed, CYCLE.carry_acceleration)
    )
    assert (after.x, after.y) == (CELLS[0].x, CELLS[0].y)
    assert MODEL.after(START, part(1, y=0.42), CELLS[0], 0.0) is None
