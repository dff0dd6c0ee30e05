"""Target speed of the train as a function of time."""

import math

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import SPEED_LAWS, ChangeSpeed, NoEvent, Reverse, Stop

VARYING_PERIOD = 4.0
"""Period of the sinusoid of ``varying`` [s]."""
GO_TIME, RAMP_TIME, REST_TIME = 4.0, 0.5, 1.5
"""``stop_and_go``: durations [s] at full speed, of slowing down or speeding up, and at rest."""
STOP_AND_GO_PERIOD = GO_TIME + RAMP_TIME + REST_TIME + RAMP_TIME
SpeedEvent = Stop | Reverse | ChangeSpeed


def check_speed_law(law: str, speed: float, variation: float) -> None:
    """Raises DrakeTrackerError unless the law is known, 0 <= speed <= 1 m/s and 0 <= variation < 1."""
    if law not in SPEED_LAWS:
        raise DrakeTrackerError(f"track speed_law '{law}' is unknown; choose one of {', '.join(SPEED_LAWS)}")
    if not 0.0 <= speed <= 1.0:
        raise DrakeTrackerError(f"track speed is {speed} m/s; it must lie between 0 (at rest) and 1 m/s")
    if not 0.0 <= variation < 1.0:
        raise DrakeTrackerError(
            f"track variation is {variation}; it is a fraction of the speed and must be at least 0 and below 1"
        )


def speed_at(law: str, speed: float, variation: float, time: float, delay: float = 0.0) -> float:
    """Returns the target speed [m/s].

    Args:
        law: ``constant``; ``varying``, a sinusoid about ``speed``; or ``stop_and_go``, which repeats travel at
            ``speed``, a smooth stop, a rest and a smooth start.
        speed: mean speed of ``constant`` and ``varying``, full speed of ``stop_and_go`` [m/s].
        variation: amplitude of the sinusoid, a fraction of ``speed``.
        time: [s].
        delay: time until which the train stands, and at which the law begins [s].
    """
    time -= delay
    if time < 0.0:
        return 0.0
    if law == "constant":
        return speed
    if law == "varying":
        return speed * (1.0 + variation * math.sin(2 * math.pi * time / VARYING_PERIOD))
    phase = time % STOP_AND_GO_PERIOD - GO_TIME
    if phase <= 0.0:
        return speed
    if phase < RAMP_TIME:
        return speed * 0.5 * (1.0 + math.cos(math.pi * phase / RAMP_TIME))
    phase -= RAMP_TIME + REST_TIME
    if phase <= 0.0:
        return 0.0
    return speed * 0.5 * (1.0 - math.cos(math.pi * phase / RAMP_TIME))


def distance_at(law: str, speed: float, variation: float, time: float, delay: float = 0.0) -> float:
    """Returns the distance [m] travelled from time 0 to ``time`` >= 0 [s], the integral of `speed_at`.

    `speed_at` explains the other arguments.
    """
    time = max(time - delay, 0.0)
    if law == "constant":
        return speed * time
    if law == "varying":
        rate = 2 * math.pi / VARYING_PERIOD
        return speed * (time + variation * (1.0 - math.cos(rate * time)) / rate)
    cycles, phase = divmod(time, STOP_AND_GO_PERIOD)
    full_speed_time = cycles * (GO_TIME + RAMP_TIME) + min(phase, GO_TIME)  # each ramp counts for half its time
    slowing = min(max(phase - GO_TIME, 0.0), RAMP_TIME)
    starting = max(phase - GO_TIME - RAMP_TIME - REST_TIME, 0.0)
    swing = RAMP_TIME / math.pi
    full_speed_time += 0.5 * (slowing + swing * math.sin(slowing / swing))
    full_speed_time += 0.5 * (starting - swing * math.sin(starting / swing))
    return speed * full_speed_time


def check_event(event: SpeedEvent | NoEvent) -> None:
    """Raises DrakeTrackerError unless an event has exactly one of ``at`` and ``after_launch``."""
    if not isinstance(event, NoEvent) and (event.at is None) == (event.after_launch is None):
        name = type(event).__name__
        raise DrakeTrackerError(f"track.event: !{name} needs either 'at' or 'after_launch', and not both")


def waits_for_launch(event: SpeedEvent | NoEvent) -> bool:
    """Returns whether an event is relative to the beginning of the first descent."""
    return not isinstance(event, NoEvent) and event.after_launch is not None


def speed_factor(event: SpeedEvent | NoEvent, time: float, launched: float) -> float:
    """Returns the factor by which an event changes the target speed.

    Args:
        event: the event.
        time: [s].
        launched: beginning of the first descent [s], infinity before it.
    """
    if isinstance(event, NoEvent):
        return 1.0
    start = launched + event.after_launch if event.after_launch is not None else event.at
    if start is None or not start <= time < start + (float("inf") if event.duration is None else event.duration):
        return 1.0
    if isinstance(event, ChangeSpeed):
        return event.factor
    return -1.0 if isinstance(event, Reverse) else 0.0
