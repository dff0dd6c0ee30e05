"""Touching three marks on the board with a guarded move (Nashman and Chaconas 1990, section 3).

The paper places "the manipulator's end effector at three locations on the board". An operator has jogged the probe over
each mark beforehand. Here the arm goes there, down slowly until it feels contact, notes where its own encoders put the
probe when the force began, and goes up again.
"""

from dataclasses import replace

import numpy as np

from drake_tracker.arm.contact_sense import contact_force, low_pass
from drake_tracker.arm.tool_motion import MotionFrame
from drake_tracker.arm.transform_equation import PEAK_OVER_MEAN
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import TouchReport
from drake_tracker.grasp.touch_schema import TouchParameters, TouchPhase, TouchState

_SHORTEST = 0.3
"""Shortest motion [s]."""
_FREE_SHARE = 0.2
"""Share of the threshold up to which nothing is felt: a soft board is not yet pressed in."""


class TouchMachine:
    """Arithmetic of the touching.

    Args:
      model: `ArmModel` whose tool frame is the probe.
      jogs: where the operator left the probe over each mark, (x, y, z, yaw) in W, shape (3, 4) [m], [rad].
      p_start: where the probe is at the start, in W [m].
      period: time between ticks [s]. parameters: `TouchParameters`.
    """

    def __init__(self, model, jogs, p_start, period, parameters=TouchParameters()):
        self.model = model
        self.jogs = np.array(jogs, dtype=float)
        self.period = period
        self.parameters = parameters
        self._way = np.vstack([p_start, self.jogs[:, :3]])

    def initial_state(self):
        nowhere = read_only(np.zeros(3))
        no_points = read_only(np.zeros((0, 3)))
        return TouchState(TouchPhase.TRAVEL, 0, 1, self._travel_time(0), 0.0, 0.0, 0.0, 0, nowhere, no_points)

    def update(self, state, time, status, q, v, acceleration, effort):
        """Returns the state after the tick at ``time`` [s].

        Args:
          status: `ToolStatus`. q, v: measured joints [rad], [rad/s]. acceleration: commanded [rad/s^2].
          effort: torques of the drives [N m].
        """
        felt = contact_force(self.model, q, v, acceleration, effort)[2]
        force = low_pass(state.force, felt, self.period, self.parameters.force_time_constant)
        state = replace(state, force=force)
        arrived = status.motion == state.motion and status.fraction >= 1.0
        if state.phase == TouchPhase.DOWN:
            return self._descend(state, time, arrived, q)
        if state.phase == TouchPhase.TRAVEL and arrived:
            lower = PEAK_OVER_MEAN * self.parameters.clearance / self.parameters.travel_speed
            return self._enter(state, TouchPhase.ABOVE, time, max(lower, _SHORTEST))
        if state.phase == TouchPhase.ABOVE and arrived:
            if time - state.since >= state.duration + self.parameters.settle:
                down = PEAK_OVER_MEAN * self.parameters.reach_below / self.parameters.descent_speed
                here = read_only(self.model.tool_pose(q).translation())
                state = replace(state, rest_force=force, felt=0, last_free=here)
                return self._enter(state, TouchPhase.DOWN, time, down)
        elif state.phase == TouchPhase.UP and arrived:
            if len(state.points) == len(self.jogs):
                return self._enter(state, TouchPhase.DONE, time, _SHORTEST)
            state = replace(state, mark=state.mark + 1)
            return self._enter(state, TouchPhase.TRAVEL, time, self._travel_time(state.mark))
        return state

    def command(self, state):
        """Returns the `ArmCommand` vector of a state: straight motions about the jogged pose, seen as the object."""
        height = self.parameters.clearance
        if state.phase == TouchPhase.ABOVE:
            height = 0.0
        elif state.phase in (TouchPhase.DOWN, TouchPhase.MISSED):
            height = -self.parameters.reach_below
        return np.array([state.phase, state.motion, state.duration, MotionFrame.OBJECT, height, 0.0, 0.0])

    def target(self, state, time):
        """Returns the `ServoTarget` vector of a state: the pose over its mark, standing still."""
        return np.concatenate([[time], self.jogs[state.mark], np.zeros(4), [time, 0.0, 0.0, 0.0, 1.0]])

    def report(self, state):
        """Returns the `TouchReport` vector of a state."""
        points = np.zeros((3, 3))
        points[: len(state.points)] = state.points
        return np.concatenate([[state.phase, state.mark, state.force - state.rest_force], points.ravel()])

    def _descend(self, state, time, arrived, q):
        push, threshold = state.force - state.rest_force, self.parameters.threshold
        if push <= _FREE_SHARE * threshold:
            state = replace(state, last_free=read_only(self.model.tool_pose(q).translation()))
        state = replace(state, felt=state.felt + 1 if push > threshold else 0)
        if state.felt >= self.parameters.samples:
            state = replace(state, points=read_only(np.vstack([state.points, state.last_free])))
            return self._enter(state, TouchPhase.UP, time, _SHORTEST)
        if arrived:
            return replace(state, phase=TouchPhase.MISSED)
        return state

    def _enter(self, state, phase, time, duration):
        return replace(state, phase=phase, motion=state.motion + 1, duration=duration, since=time)

    def _travel_time(self, mark):
        distance = np.linalg.norm(self._way[mark + 1] - self._way[mark])
        return max(PEAK_OVER_MEAN * distance / self.parameters.travel_speed, _SHORTEST)


def touched_points(report):
    """Returns the touched positions of the probe's centre, p_WP [m] in W, shape (3, 3), of a `TouchReport` vector.

    Raises DrakeTrackerError when a descent found nothing, or when the touching is not done.
    """
    fields = TouchReport(np.asarray(report))
    if fields.phase == TouchPhase.MISSED:
        raise DrakeTrackerError(
            f"the arm felt nothing below mark {int(fields.mark) + 1} of the board: is the board where the scenario "
            "(board.edge_position) has it?"
        )
    if fields.phase != TouchPhase.DONE:
        raise DrakeTrackerError(f"the arm has not finished touching the board: {TouchPhase(int(fields.phase)).name}")
    return np.asarray(report)[3:].reshape(3, 3)
