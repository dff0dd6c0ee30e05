"""All rates, lags and phase offsets, with the numbers of the papers.

All periods are multiples of the plant's step. Two subsystems never update at the same instant: within a plant step each
has its own slot. Every lag therefore has a single value, and the order in which Systems were added has no effect.

    slot (fraction of a plant step)   System
    0                                 plant, cameras, motion centroid, delay line; readers of images and ground truth
    1/8                               plane projector (one camera); the triangulator (two) has no state and no slot
    3/16                              camera on the hand
    1/4                               estimator
    1/2                               link
    5/8                               packet guard
    11/16 of every plant step         collision reflex
    3/4 (in the last plant step of    servo, then 13/16 grasp, 14/16 transform equation, 15/16 inverse kinematics,
         a servo period)             31/32 joint limiter

The servo and the Systems after it update in the *last* plant step of each servo period. The joint interpolator samples
at the multiples of that period and therefore reads a set-point that is a fraction of a plant step old.
"""

import math

from drake_tracker.core.errors import DrakeTrackerError

TIME_STEP = 1.0 / 300.0
"""Plant step of the train's task [s]: 1/60 s is 5 steps, 30 ms is 9 steps."""
VISION_PERIOD = 1.0 / 60.0
"""One PIPE cycle [s] (section 3.1: "one cycle - 1/60 second")."""
LAG_CYCLES = 15
"""Cycles from the capture of the middle image I1 to its centroid (section 3.1: "15 cycles or 0.25 seconds"). The newest
image used, I2, is one stride younger: the centroid appears 14 cycles after it, or 13 with images every other cycle."""
SERVO_PERIOD = 0.030
"""Period of the trajectory generator [s] (section 4.4: "every 30 msec")."""

BALL_TIME_STEP = 1.0 / 600.0
"""Plant step of the ball's task [s]: 1/60 s is 10 steps, 5 ms is 3 steps."""
BALL_SERVO_PERIOD = 0.005
"""Period of the manipulator's set-points [s] (Nashman and Chaconas 1990, section 4: "at 5ms intervals")."""
BALL_UPDATE_CYCLES = 4
"""Cycles between two centroids of the ball (section 4: "an update rate of 66.8 ms")."""
BALL_THROUGHPUT_CYCLES = 6
"""Cycles from digitizing an image to the centroid based on it (section 4: "a throughput time of 100.2 ms")."""

KNOT_COUNT = 31
"""Knots in a predicted path: 1.5 s at `KNOT_SPACING`."""
KNOT_SPACING = 0.05
"""Time between two knots of a predicted path [s]."""
PATH_DURATION = (KNOT_COUNT - 1) * KNOT_SPACING
"""Time [s] from the stamp of a predicted path to its end."""

PROJECTOR_SLOT = 2 / 16
WRIST_SLOT = 3 / 16
ESTIMATOR_SLOT = 4 / 16
LINK_SLOT = 8 / 16
GUARD_SLOT = 10 / 16
REFLEX_SLOT = 11 / 16
SERVO_SLOT = 12 / 16
GRASP_SLOT = 13 / 16
TRANSFORM_SLOT = 14 / 16
IK_SLOT = 15 / 16
LIMITER_SLOT = 31 / 32


def steps_in(period: float, time_step: float = TIME_STEP) -> int:
    """Returns the number of plant steps in a period.

    Args:
        period: the period [s].
        time_step: the plant's step [s].

    Raises DrakeTrackerError when the period is not a whole number of plant steps.
    """
    steps = round(period / time_step)
    if steps < 1 or not math.isclose(steps * time_step, period, rel_tol=1e-9):
        raise DrakeTrackerError(f"the period {period:g} s must be a whole number of plant steps of {time_step:g} s")
    return steps


def vision_slot(slot: float, time_step: float = TIME_STEP) -> float:
    """Returns the offset [s] of a System with the vision period.

    Args:
        slot: fraction of a plant step after the images of the same cycle.
        time_step: the plant's step [s].
    """
    return slot * time_step


def servo_slot(slot: float, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> float:
    """Returns the offset [s] of a System with the servo period.

    Args:
        slot: fraction of the last plant step of the period.
        time_step: the plant's step [s].
        period: the servo period [s].

    Raises DrakeTrackerError when the period is not a whole number of plant steps.
    """
    return (steps_in(period, time_step) - 1 + slot) * time_step


def capture_time(time: float, latency: int, period: float = VISION_PERIOD, offset: float = 0.0) -> float:
    """Returns when an image was captured that appears some cycles late [s], to the last bit the time of its cycle.

    Args:
        time: present time [s].
        latency: cycles from the capture until the image appears.
        period: of a cycle [s].
        offset: of the captures within a cycle [s].
    """
    if latency == 0:
        return time
    return offset + (round((time - offset) / period) - latency) * period


def delay_cycles(lag_cycles: float, newest_image_age_cycles: float) -> int:
    """Returns the number of cycles for which a centroid must be held back to obtain a given lag.

    Args:
        lag_cycles: time from the stamp of a centroid until it appears [cycles].
        newest_image_age_cycles: time from the stamp to the newest image used [cycles]: 1 for normal flow on consecutive
            images, 2 for images every other cycle.

    Raises DrakeTrackerError when the result is negative or not a whole number.
    """
    cycles = lag_cycles - newest_image_age_cycles
    if cycles != round(cycles) or cycles < 0:
        raise DrakeTrackerError(
            f"a lag of {lag_cycles:g} cycles leaves {cycles:g} cycles after the newest image; this must be a whole "
            "number, 0 or more"
        )
    return int(cycles)


def lag_after_latency(lag_cycles: int, image_latency: int) -> int:
    """Returns the cycles from when the inputs show an image until what follows from it appears.

    Args:
        lag_cycles: cycles from the capture of an image until what follows from it appears.
        image_latency: cycles from the capture of an image until the inputs show it.

    Raises DrakeTrackerError when the lag is shorter than the latency.
    """
    if lag_cycles < image_latency:
        raise DrakeTrackerError(f"a lag of {lag_cycles} cycles is shorter than the latency of the images")
    return int(lag_cycles) - image_latency


def lag_of_throughput(throughput_cycles: float, first_image_age_cycles: float, stamp_age_cycles: float) -> float:
    """Returns the lag [cycles], from the stamp of a centroid until it appears, that corresponds to a throughput.

    Nashman and Chaconas 1990 count the throughput "between digitizing an image and outputting results dependent on that
    image" (section 4): 6 cycles from the first image of a pair. The stamp is later than the first image. For a
    difference of images ``stride`` cycles apart, the two ages are stride and stride/2. The stamp may then fall between
    two cycles, but the delay, throughput - stride, is still a whole number.

    Args:
        throughput_cycles: time from the capture of the first image until the centroid appears [cycles].
        first_image_age_cycles: age of the first image when the newest image is captured [cycles].
        stamp_age_cycles: age of the stamp at the same instant [cycles].
    """
    return throughput_cycles - (first_image_age_cycles - stamp_age_cycles)
