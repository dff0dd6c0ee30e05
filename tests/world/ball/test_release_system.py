import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.ball.release_system import DELAY_RANGE, ReleaseSystem, draw_delay

TRAVEL = 0.034


def positions(delay, ready, until=4.0):
    """Times and set-points of the gate while ``ready(time)`` says whether the arm is."""
    release = ReleaseSystem(delay, TRAVEL)
    simulator = Simulator(release)
    context = simulator.get_mutable_context()
    rows = []
    for k in range(round(until / VISION_PERIOD)):
        release.GetInputPort("ready").FixValue(context, [float(ready(k * VISION_PERIOD))])
        simulator.AdvanceTo((k + 0.5) * VISION_PERIOD)
        rows.append([k * VISION_PERIOD, *release.GetOutputPort("gate_desired_state").Eval(context)])
    return np.array(rows)


@pytest.mark.parametrize("seed", range(3))
def test_it_opens_a_delay_after_the_arm_is_ready_and_stays_open(seed):
    rows = positions(draw_delay(seed), lambda t: 1.0 < t < 1.2)
    opened = rows[rows[:, 1] > 0.0, 0]
    assert opened[0] == pytest.approx(1.0 + draw_delay(seed), abs=2 * VISION_PERIOD)
    assert len(opened) == np.sum(rows[:, 0] >= opened[0]), "it never closes again"
    assert set(rows[:, 1]) == {0.0, TRAVEL} and np.all(rows[:, 2] == 0.0)


def test_without_a_ready_arm_it_stays_closed():
    assert np.all(positions(0.3, lambda t: False)[:, 1:] == 0.0)


def test_a_gate_may_stay_closed():
    assert np.all(positions(np.inf, lambda t: True)[:, 1:] == 0.0)


def test_delays_fill_their_range():
    delays = [draw_delay(seed) for seed in range(300)]
    assert DELAY_RANGE[0] <= min(delays) < 0.32 and 0.98 < max(delays) <= DELAY_RANGE[1]
    assert draw_delay(3) == draw_delay(3)
