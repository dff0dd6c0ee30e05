"""The arm's cycle: when a part can be picked, and when its hand is free again.

The hand moves over the part, follows it during the descent and while the jaws close, lifts it, carries it to a cell,
lowers and releases it, and rises. A part moves on while the hand approaches. The earliest meeting is found exactly: by
Newton's method, which converges from one side, while the hand only accelerates and brakes, and by a quadratic equation
beyond.
"""

import math

from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
from drake_tracker.dispatch.config import CycleTime, PickWindow

ITERATIONS = 60
"""Newton's method needs about five steps; only near a double root does it need more."""
TOLERANCE, SHORT = 1e-12, 1e-3
"""Steps below the first [s] end the iteration. Before the second [s] they must be smaller in proportion to the time:
a hand that is almost at the part needs the square root of the distance."""


class CycleModel:
    """Predicts the times of a cycle.

    Args:
        cycle: durations, speeds and accelerations.
        window: where parts may be picked.
    """

    def __init__(self, cycle: CycleTime, window: PickWindow) -> None:
        self.cycle = cycle
        self.window = window

    def pick_time(self, hand: FreeHand, candidate: Candidate, now: float) -> float | None:
        """Returns the earliest time at which the jaws have closed on a part [s].

        Args:
            hand: where and when the hand is free.
            candidate: the part, as it is at ``now``.
            now: time at which ``candidate`` is where it says [s].

        Returns None when the part has left the window by then, or moves as fast as the hand.
        """
        cycle, part = self.cycle, candidate
        if abs(part.v) >= cycle.approach_speed:
            return None
        start = max(now, hand.free_at)
        enters, leaves = self.in_window(part, now)
        if enters > leaves:
            return None
        follow = cycle.descent + cycle.close
        met = meeting_time(
            part.x - hand.x,
            part.y + part.v * (start - now) - hand.y,
            part.v,
            cycle.approach_speed,
            cycle.approach_acceleration,
            max(0.0, enters - follow - start),
        )
        pick = max(start + met + follow, enters)
        return pick if pick <= leaves else None

    def in_window(self, candidate: Candidate, now: float) -> tuple[float, float]:
        """Returns the times at which a part enters and leaves the window [s].

        Infinite times say that it never does; the first is at most the second only if it is in the window at some
        time from ``now`` on.
        """
        before, behind = self.window.y_first - candidate.y, self.window.y_last - candidate.y
        if candidate.v <= 0.0:  # a part on a belt at rest
            inside = before <= 0.0 <= behind
            return (now, math.inf) if inside else (math.inf, -math.inf)
        return now + max(0.0, before / candidate.v), now + behind / candidate.v

    def place_time(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        """Returns the time at which the part is in a cell and the hand is free above it [s].

        Args:
            candidate: the part, as it is at ``now``.
            pick: time at which the jaws have closed [s].
            cell: where the part goes.
            now: time at which ``candidate`` is where it says [s].
        """
        cycle = self.cycle
        distance = math.hypot(cell.x - candidate.x, cell.y - candidate.y - candidate.v * (pick - now))
        carry = motion_time(distance, cycle.carry_speed, cycle.carry_acceleration)
        return pick + cycle.lift + carry + cycle.lower + cycle.release + cycle.rise

    def after(self, hand: FreeHand, candidate: Candidate, cell: Cell, now: float) -> tuple[float, FreeHand] | None:
        """Returns the time of a pick [s] and the hand after the part is in its cell; None if it cannot be picked."""
        pick = self.pick_time(hand, candidate, now)
        if pick is None:
            return None
        return pick, FreeHand(cell.x, cell.y, self.place_time(candidate, pick, cell, now))


def motion_time(distance: float, speed: float, acceleration: float) -> float:
    """Returns the least duration of a motion from rest to rest [s].

    Args:
        distance: length of the motion [m].
        speed: largest speed [m/s].
        acceleration: acceleration and deceleration [m/s^2].
    """
    if distance < speed * speed / acceleration:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration


def meeting_time(
    across: float, along: float, v: float, speed: float, acceleration: float, earliest: float = 0.0
) -> float:
    """Returns the first time t >= ``earliest`` at which a hand that starts at 0 can be where a moving part is [s].

    This is the first t with ``motion_time(distance(t)) <= t``: a hand that arrives early waits.

    Args:
        across: distance of the part from the hand at time 0, across its motion [m].
        along: the same along its motion, positive where it has passed the hand [m].
        v: speed of the part [m/s], less than ``speed``.
        speed: largest speed of the hand [m/s].
        acceleration: its acceleration and deceleration [m/s^2].
        earliest: time before which they do not meet [s].
    """
    cruise = 2.0 * speed / acceleration  # shortest motion that reaches the largest speed
    if motion_time(math.hypot(across, along + v * earliest), speed, acceleration) <= earliest:
        return earliest
    if earliest < cruise:
        met = _meeting_before_cruise(across, along, v, acceleration, earliest, cruise)
        if met is not None:
            return met
    # (speed (t - speed/acceleration))^2 = across^2 + (along + v t)^2
    a = speed * speed - v * v
    b = -(speed**3 / acceleration + along * v)  # half of the linear coefficient
    c = speed**4 / acceleration**2 - across * across - along * along
    return (-b + math.sqrt(max(b * b - a * c, 0.0))) / a


def _meeting_before_cruise(
    across: float, along: float, v: float, acceleration: float, earliest: float, cruise: float
) -> float | None:
    """Returns the first root from ``earliest`` to ``cruise`` of
    q(t) = (acceleration t^2 / 4)^2 - across^2 - (along + v t)^2, or None.

    q is negative at ``earliest``. It is concave first and convex afterwards. In the concave part, Newton's method
    approaches the first root from the left; in the convex part, in which there is only one, from the right.
    """
    k = acceleration * acceleration / 16.0
    bend = min(math.sqrt(v * v / (6.0 * k)), cruise)
    t = earliest
    for _ in range(ITERATIONS):
        if t >= bend:
            break
        value, slope = _q(t, k, across, along, v)
        if slope <= 0.0:
            break
        step = -value / slope
        if step <= TOLERANCE * min(t / SHORT, 1.0):
            return t
        t += step
    t = cruise
    if _q(t, k, across, along, v)[0] < 0.0:
        return None
    for _ in range(ITERATIONS):
        value, slope = _q(t, k, across, along, v)
        step = value / slope
        t -= step
        if step <= TOLERANCE:
            break
    return t


def _q(t: float, k: float, across: float, along: float, v: float) -> tuple[float, float]:
    """Returns q(t) of `_meeting_before_cruise`, and its derivative."""
    y = along + v * t
    return k * t**4 - across * across - y * y, 4.0 * k * t**3 - 2.0 * v * y
