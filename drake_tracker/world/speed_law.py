"""Target speed of the train as a function of time."""

import math

from drake_tracker.core.errors import DrakeTrackerError

SPEED_LAWS = ("constant", "varying", "stop_and_go")

VARYING_PERIOD = 4.0
"""Period of the sinusoid of ``varying`` [s]."""
GO_TIME, RAMP_TIME, REST_TIME = 4.0, 0.5, 1.5
"""``stop_and_go``: at full speed, slowing down (and speeding up again), at rest [s]."""
STOP_AND_GO_PERIOD = GO_TIME + RAMP_TIME + REST_TIME + RAMP_TIME


def check_speed_law(law, speed, variation):
    """Raises DrakeTrackerError unless the law is known, 0 <= speed <= 1 m/s and 0 <= variation < 1."""
    if law not in SPEED_LAWS:
        raise DrakeTrackerError(f"track speed_law '{law}' is unknown; choose one of {', '.join(SPEED_LAWS)}")
    if not 0.0 <= speed <= 1.0:
        raise DrakeTrackerError(f"track speed is {speed} m/s; it must be from 0 (at rest) to 1")
    if not 0.0 <= variation < 1.0:
        raise DrakeTrackerError(f"track variation is {variation}; it is a fraction of the speed, from 0 to below 1")


def speed_at(law, speed, variation, time):
    """Returns the target speed [m/s] at ``time`` [s].

    ``constant``: ``speed``. ``varying``: a sinusoid of +-``variation`` (a fraction) about ``speed``. ``stop_and_go``:
    at ``speed``, a smooth stop, a rest, a smooth start, and again.
    """
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


def distance_at(law, speed, variation, time):
    """Returns the distance [m] covered from time 0 to ``time`` >= 0 [s]: the integral of `speed_at`."""
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
