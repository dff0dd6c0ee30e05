"""Every rate, lag and phase offset in one place, the 1991 paper's number beside each.

The plant's step makes everything commensurate. Rooms never share an instant: within one plant step each room updates in
a slot of its own, so that a lag is one single value and the order in which Systems were added does not matter.

    slot (fraction of a plant step)   room
    0                                 plant, cameras, motion centroid; delay line; video and truth readers
    1/8                               plane projector (one camera); the triangulator (two) has no state and no slot
    1/4                               estimator
    1/2                               link
    3/4 (of the last plant step of    servo, then 13/16 grasp, 14/16 transform equation, 15/16 inverse kinematics
         a servo period)

The servo room works in the *last* plant step of each 30 ms period, so that the joint interpolator, which samples on the
period's grid, reads a set-point that is a fraction of a plant step old.
"""

import math

from drake_tracker.core.errors import DrakeTrackerError

TIME_STEP = 1.0 / 300.0
"""Plant step [s]: 60 Hz is 5 steps, 30 ms is 9 steps."""
VISION_PERIOD = 1.0 / 60.0
"""One PIPE cycle [s] (section 3.1: "one cycle - 1/60 second")."""
LAG_CYCLES = 15
"""Cycles from the capture of the middle image I1 to its centroid (section 3.1: "15 cycles or 0.25 seconds")."""
SERVO_PERIOD = 0.030
"""Period of the trajectory generator [s] (section 4.4: "every 30 msec")."""

BALL_TIME_STEP = 1.0 / 600.0
"""Plant step [s] of the ball's task: 60 Hz is 10 steps, 5 ms is 3 steps."""
BALL_SERVO_PERIOD = 0.005
"""Period of the manipulator's set-points [s] (Nashman and Chaconas 1990, section 4: "at 5ms intervals")."""
BALL_UPDATE_CYCLES = 4
"""Cycles between two centroids of the ball (section 4: "an update rate of 66.8 ms")."""
BALL_THROUGHPUT_CYCLES = 6
"""Cycles from digitizing an image to the centroid that rests on it (section 4: "a throughput time of 100.2 ms")."""

PROJECTOR_SLOT = 2 / 16
ESTIMATOR_SLOT = 4 / 16
LINK_SLOT = 8 / 16
SERVO_SLOT = 12 / 16
GRASP_SLOT = 13 / 16
TRANSFORM_SLOT = 14 / 16
IK_SLOT = 15 / 16


def steps_in(period: float, time_step: float = TIME_STEP) -> int:
    """Returns how many plant steps a period [s] takes.

    Raises DrakeTrackerError when it is not a whole number of them.
    """
    steps = round(period / time_step)
    if steps < 1 or not math.isclose(steps * time_step, period, rel_tol=1e-9):
        raise DrakeTrackerError(
            f"period {period:g} s is not a whole number of plant steps of {time_step:g} s; choose a period that is"
        )
    return steps


def vision_slot(slot: float, time_step: float = TIME_STEP) -> float:
    """Offset [s] of a System that runs at the vision period, in the given slot after the images of the same cycle."""
    return slot * time_step


def servo_slot(slot: float, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> float:
    """Offset [s] of a System that runs at the servo period: the given slot of the period's last plant step."""
    return (steps_in(period, time_step) - 1 + slot) * time_step


def delay_cycles(lag_cycles: float, newest_image_age_cycles: float) -> int:
    """Returns the whole number of cycles that a centroid is held so that it appears ``lag_cycles`` after its stamp.

    ``newest_image_age_cycles`` is (time of the newest image used - stamp) / period: 1 for normal flow on consecutive
    images, 2 for images every other cycle.  Raises DrakeTrackerError when the result is negative or not whole.
    """
    cycles = lag_cycles - newest_image_age_cycles
    if cycles != round(cycles) or cycles < 0:
        raise DrakeTrackerError(
            f"a lag of {lag_cycles:g} cycles leaves {cycles:g} cycles after the newest image; it must be whole and >= 0"
        )
    return int(cycles)


def lag_of_throughput(throughput_cycles: float, first_image_age_cycles: float, stamp_age_cycles: float) -> float:
    """Returns the cycles from a centroid's stamp until it shows, given those from the capture of its first image.

    Nashman and Chaconas 1990 count a throughput "between digitizing an image and outputting results dependent on that
    image" (section 4): 6 cycles from the first image of a pair. A stamp lies later than the first image. Both ages
    [cycles] are those at the capture of the newest image. For a difference of images ``stride`` cycles apart they are
    stride and stride/2: the stamp may fall between two cycles, the delay, throughput - stride, is whole all the same.
    """
    return throughput_cycles - (first_image_age_cycles - stamp_age_cycles)
