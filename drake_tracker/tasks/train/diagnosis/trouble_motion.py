"""Trouble with the train: it stopped, turned back, was moved, or left its track before the hand touched it."""

from collections.abc import Sequence

import numpy as np

from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.jaws import FORCE_SHARE, WIDTH_TOLERANCE
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, during
from drake_tracker.tasks.train.diagnosis.judged_train import FIRST_TRAIN
from drake_tracker.tasks.train.diagnosis.trouble import Cause, Trouble, stretches, troubles
from drake_tracker.tasks.train.episode import train_places, train_pose
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.tasks.train.track_placement import last_place
from drake_tracker.world.train.speed_law import speed_at

STARTING = 1.0
"""Time in which the train reaches its speed [s]."""
SLOW, FAST = 0.3, 1.6
"""A train below or above these fractions of the speed of its speed law does not follow the law."""
BESIDE = 0.010
"""Distance from the track [m] at which the train does not stand on the rail; 6 mm is the most that occurs, in the
tightest corners."""
RAISED = 0.010
"""Height above the rail [m] at which the train no longer stands on the rail."""
CARRIED = 0.03
"""Height above the rail [m] to which a train is lifted only if it is carried."""
END_ZONE = 0.05
"""Distance before the end of an open track [m] in which the rail slows the train down."""
FOLLOWING_ERROR = 0.05
"""Distance of a joint from its set-point [rad] that does not occur in normal runs; 0.025 rad is the most that does."""
JAWS_LATE = 0.012
"""Excess of the jaws' opening over the commanded one [m] that does not occur in normal runs; 4 mm is the most."""
_DELAY = SPLINE_DELAY * SERVO_PERIOD


def motion_troubles(setup: TrainSetup, log: Log, until: float) -> list[Trouble]:
    """Returns where the train did not move as its speed law says, in order of time.

    Only the first train is watched: there is none in a log that is about another object.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        until: time until which the train is watched [s], normally the first touch of the hand.
    """
    truth, verdict = log["truth_train_state"], log["truth_verdict"]
    seen = (truth.times > STARTING) & (truth.times <= until)
    times = truth.times[seen]
    if len(times) == 0 or FIRST_TRAIN in log:
        return []
    vx, vy = truth.view("vx", "vy")[seen].T
    track, _ = setup.placement
    places = train_places(setup, log, until)[seen[truth.times <= until]]
    turns = setup.scenario.track.turns
    yaw = train_pose(log, times)[:, 3] if turns else track.pose(places[:, 0])[2]
    lift = np.interp(times, verdict.times, verdict["lift"])
    law = (setup.scenario.track.speed_law, setup.scenario.track.speed, setup.scenario.track.variation)
    wanted = np.array([speed_at(*law, time, setup.scenario.train.start_delay) for time in times])
    speed = np.cos(yaw) * vx + np.sin(yaw) * vy

    beside = (np.abs(places[:, 1]) > BESIDE) | (np.abs(lift) > RAISED)
    braking = not track.closed and places[:, 0] > last_place(track, setup.scenario.train) - END_ZONE
    follows = ~beside & (wanted > 0.0) & ~np.asarray(braking)
    found = [
        *_beside_its_track(setup, log, times, beside, until),
        *troubles(Cause.TRAIN_REVERSED, "the train ran backwards", times, follows & (speed < -SLOW * wanted), 0.3),
        *troubles(Cause.TRAIN_STOPPED, "the train stood still", times, follows & (abs(speed) < SLOW * wanted), 0.3),
        *troubles(Cause.TRAIN_DISPLACED, "the train was pushed", times, follows & (speed > FAST * wanted), 0.05),
    ]
    if not track.closed:
        found += troubles(Cause.TRACK_END, "the train stood at the end of its track", times, braking & ~beside, 0.5)
    return sorted(found, key=lambda trouble: trouble.start)


def _beside_its_track(
    setup: TrainSetup, log: Log, times: np.ndarray, beside: np.ndarray, until: float
) -> list[Trouble]:
    """Returns the intervals in which the train was not on its track, each with the outcome."""
    found = troubles(Cause.TRAIN_DISPLACED, "the train was moved", times, beside, 0.05, bridge=0.5)
    if not found or found[-1].end < times[-1] - 0.1:
        return found
    last = found.pop()
    verdict, truth = log["truth_verdict"], log["truth_train_state"]
    here = (verdict.times >= last.start) & (verdict.times <= until)
    carried = verdict["lift"][here].max(initial=0.0) > CARRIED
    if not carried:
        return [*found, Trouble(Cause.DERAILED, last.start, last.end, "the train was off its track")]
    place = np.array([np.interp(last.end, truth.times, truth[axis]) for axis in "xy"])
    low, high = (np.array(corner[:2]) for corner in setup.scenario.vision.work_volume)
    if np.all(place >= low) and np.all(place <= high):
        return [*found, Trouble(Cause.TRAIN_DISPLACED, last.start, last.end, "the train was moved off its track")]
    return [*found, Trouble(Cause.TRAIN_LOST, last.start, last.end, "the train was taken away")]


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
    times, width = jaws.times, setup.grasp.object_width
    asked = np.interp(times - _DELAY, command.times, command["jaw_width"])
    closing = during(spans, times, Phase.CLOSE)
    open_ = jaws["width"] > width + WIDTH_TOLERANCE
    slow = closing & open_ & (times <= touch) & (jaws["width"] > asked + JAWS_LATE)
    on_object = (np.abs(jaws["width"] - width) <= WIDTH_TOLERANCE) & (asked < width - WIDTH_TOLERANCE)
    gripping = during(spans, times, Phase.CLOSE, Phase.LIFT, Phase.HOLD)
    weak = gripping & on_object & (jaws["force"] < FORCE_SHARE * setup.grasp.grip_force)
    return [
        *troubles(Cause.GRIPPER, "the jaws closed more slowly than commanded", times, slow, 0.06),
        *troubles(Cause.GRIPPER, "the jaws pressed on the train with too little force", times, weak, 0.25),
    ]
