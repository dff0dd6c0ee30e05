"""What the page asks of a run, and how the run is held."""

import threading

import pytest

from drake_tracker.live.control import Control


class Clock:
    """Wall time [s] that goes on only while the run waits."""

    now = 100.0

    def __call__(self):
        return self.now

    def wait(self):
        self.now += 0.02


def in_thread(control, now):
    """Starts `Control.hold` in a thread; returns it, once it holds or is over."""
    holds = threading.Event()
    thread = threading.Thread(target=lambda: (control.hold(now, idle=holds.set), holds.set()))
    thread.start()
    assert holds.wait(5.0)
    return thread


def test_a_run_goes_on_unless_it_is_asked_to_wait():
    control = Control(Clock())
    for k in range(100):
        control.hold(k / 60)
    assert control.held == 0.0


def test_a_paused_run_stands_until_it_is_resumed():
    control = Control()
    control.pause()
    thread = in_thread(control, 1.0)
    thread.join(0.2)
    assert thread.is_alive() and control.paused
    control.resume()
    thread.join(5.0)
    assert not thread.is_alive() and control.held >= 0.2


def test_a_step_lets_one_cycle_pass_and_no_more():
    control = Control()
    control.step()
    control.hold(1.0)
    assert control.paused
    thread = in_thread(control, 1.0 + 1 / 60)
    assert thread.is_alive()
    control.step()
    thread.join(5.0)
    assert not thread.is_alive() and control.paused


def test_an_interrupted_run_is_not_held():
    control = Control()
    control.pause()
    interrupted = []
    control.hold(1.0, interrupted=lambda: bool(interrupted), idle=lambda: interrupted.append(True))
    assert interrupted == [True] and control.paused


def test_a_rate_makes_the_run_wait_for_the_wall_clock():
    clock = Clock()
    control = Control(clock)
    control.set_rate(0.5)
    control.hold(2.0)
    control.hold(2.05, idle=clock.wait)
    assert control.held == pytest.approx(0.1, abs=0.021)
    control.set_rate(None)
    control.hold(3.0)
    assert control.held == pytest.approx(0.1, abs=0.021)


def test_a_run_that_is_slower_than_its_rate_does_not_hurry_afterwards():
    clock = Clock()
    control = Control(clock)
    control.set_rate(1.0)
    control.hold(0.0)
    clock.now += 10.0
    control.hold(1.0)
    control.hold(1.1, idle=clock.wait)
    assert control.held == pytest.approx(0.1, abs=0.021)


@pytest.mark.parametrize("rate", [0, -1.0, 7, "1", [], True])
def test_other_rates_are_refused(rate):
    control = Control()
    with pytest.raises(ValueError, match="rate must be null or one of 0.1, 0.25, 0.5, 1.0"):
        control.set_rate(rate)
    assert control.rate is None
