"""The arm's reaction to a collision: a drive that pushes against an obstacle with all its torque gives way.

A drive may need all its torque for a moment when the arm changes its direction fast. It pushes against something if the
arm does not accelerate as that torque would make it.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.timing import TIME_STEP

PATIENCE = 0.017
"""Time for which a drive is saturated before the arm judges whether something is in the way [s]."""
RESISTANCE = 0.3
"""Fraction of a drive's largest torque that must be missing in the motion of the arm, for something to be in the
way."""
HOLD = 0.12
"""Time for which the joints then hold still [s]: four periods of the servo."""
COAST = 1.0 / 30.0
"""Time [s] by which a joint that still moves may coast on before it holds still: 2/w for a servo of bandwidth w = 60
rad/s, whose torque is then zero at first. A joint that had to stop at once would need all its torque again."""
SATURATED = 0.999
"""Fraction of a drive's largest torque that counts as saturation."""


@dataclass(frozen=True)
class ReflexState(FrozenState):
    """State of the reflex.

    Attributes:
        saturated: number of samples in a row in which each drive was saturated, shape (n,).
        v_before: joint velocities when the first drive became saturated, shape (n,) [rad/s].
        since: time of that sample [s].
        until: time until which the joints hold still [s].
        q_hold: where they hold still, shape (n,) [rad].
        held: whether they do now.
    """

    saturated: np.ndarray
    v_before: np.ndarray
    since: float
    until: float
    q_hold: np.ndarray
    held: bool = False


class CollisionReflex:
    """Arithmetic of the reflex.

    Args:
        model: the arm.
        period: period of the samples [s].
    """

    def __init__(self, model: ArmModel, period: float = TIME_STEP) -> None:
        self._model = model
        self._largest = SATURATED * model.effort_limit
        self._patience = max(1, round(PATIENCE / period))
        self._lower, self._upper = model.position_lower, model.position_upper
        self._none = read_only(np.zeros(model.num_joints))

    def initial_state(self) -> ReflexState:
        """Returns the state at the start: the joints are free."""
        return ReflexState(self._none, self._none, 0.0, 0.0, self._none)

    def update(self, state: ReflexState, time: float, q: np.ndarray, v: np.ndarray, effort: np.ndarray) -> ReflexState:
        """Returns the state after a sample.

        Args:
            state: the state before.
            time: present time [s].
            q: measured joint positions, shape (n,) [rad].
            v: measured joint velocities, shape (n,) [rad/s].
            effort: torques of the drives, shape (n,) [N m].
        """
        full = np.abs(effort) >= self._largest
        if not full.any() and not state.held:
            return state if state.saturated is self._none else replace(state, saturated=self._none)
        if state.held:
            held = time < state.until
            return state if held else replace(state, held=False, saturated=self._none)
        if state.saturated is self._none:
            state = replace(state, v_before=read_only(np.array(v)), since=time)
        saturated = np.where(full, state.saturated + 1.0, 0.0)
        state = replace(state, saturated=read_only(saturated))
        long = saturated >= self._patience
        if not (long & (self._missing(state, time, q, v, effort) > RESISTANCE)).any():
            return state
        q_hold = np.clip(q + COAST * v, self._lower, self._upper)
        return replace(state, saturated=self._none, until=time + HOLD, q_hold=read_only(q_hold), held=True)

    def _missing(self, state: ReflexState, time: float, q: np.ndarray, v: np.ndarray, effort: np.ndarray) -> np.ndarray:
        """Returns which fraction of its largest torque each drive exerts without an effect on the motion, shape (n,).

        The motion is that since the first drive became saturated.
        """
        if time <= state.since:
            return np.zeros_like(v)
        acceleration = (v - state.v_before) / (time - state.since)
        moving = self._model.drive_torques(q, 0.5 * (v + state.v_before), acceleration)
        return np.abs(effort - moving) / self._model.effort_limit
