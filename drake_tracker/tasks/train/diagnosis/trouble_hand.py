"""Trouble with the arm and its gripper: joints that do not follow, jaws that are slow or weak."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.jaws import FORCE_SHARE, WIDTH_TOLERANCE
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, during
from drake_tracker.tasks.train.diagnosis.trouble import Cause, Trouble, stretches, troubles
from drake_tracker.tasks.train.setup import TrainSetup

FOLLOWING_ERROR = 0.05
"""Distance of a joint from its set-point [rad] that does not occur in normal runs; 0.025 rad is the most that does."""
JAWS_LATE = 0.012
"""Excess of the jaws' opening over the commanded one [m] that does not occur in normal runs; 4 mm is the most."""
_DELAY = SPLINE_DELAY * SERVO_PERIOD


def operator_troubles(spans: Sequence[PhaseSpan], until: float) -> list[Trouble]:
    """Returns where the operator stopped the arm, or had taken it over.

    Args:
        spans: phases of the run.
        until: time until which the phases are considered [s].
    """
    clauses = {Phase.STOPPED: "the operator had stopped the arm", Phase.MANUAL: "the operator had taken over the arm"}
    return [
        Trouble(Cause.OPERATOR, span.start, min(span.end, until), clauses[Phase(span.phase)])
        for span in spans
        if span.phase in clauses and span.start < until
    ]


def arm_troubles(log: Log, until: float) -> list[Trouble]:
    """Returns where a joint did not follow its set-points.

    Args:
        log: {name: Signal} of the run.
        until: time until which the joints are judged [s], normally the first touch of the train.
    """
    commanded, state = log["q_commanded"], log["arm_state"]
    n = commanded.data.shape[1]
    if len(commanded.times) == 0:
        return []
    found = []
    for joint in range(n):
        set_point = np.interp(state.times - _DELAY, commanded.times, commanded.data[:, joint])
        error = np.abs(state.data[:, joint] - set_point)
        far = (state.times <= until) & (state.times > _DELAY) & (error > FOLLOWING_ERROR)
        for start, end in stretches(state.times, far, 0.05):
            here = (state.times >= start) & (state.times <= end)
            clause = f"joint {joint + 1} was up to {error[here].max():.2f} rad from its set-point"
            found.append(Trouble(Cause.ARM, start, end, clause))
    return found


def gripper_troubles(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan], touch: float) -> list[Trouble]:
    """Returns where the jaws closed too slowly, or pressed too weakly on the train.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.
        touch: time until which nothing holds the jaws back [s], normally the first touch of the train.
    """
    jaws, command = log["jaws"], log["command"]
    if len(command.times) == 0:
        return []
    times, width = jaws.times, setup.scenario.grasp.object_width
    asked = np.interp(times - _DELAY, command.times, command["jaw_width"])
    closing = during(spans, times, Phase.CLOSE)
    open_ = jaws["width"] > width + WIDTH_TOLERANCE
    slow = closing & open_ & (times <= touch) & (jaws["width"] > asked + JAWS_LATE)
    on_object = (np.abs(jaws["width"] - width) <= WIDTH_TOLERANCE) & (asked < width - WIDTH_TOLERANCE)
    gripping = during(spans, times, Phase.CLOSE, Phase.LIFT, Phase.HOLD)
    weak = gripping & on_object & (jaws["force"] < FORCE_SHARE * setup.scenario.grasp.grip_force)
    return [
        *troubles(Cause.GRIPPER, "the jaws closed more slowly than commanded", times, slow, 0.06),
        *troubles(Cause.GRIPPER, "the jaws pressed on the train with too little force", times, weak, 0.25),
    ]
