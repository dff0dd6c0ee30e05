"""The trajectory generator's fixed-gain filter (Allen et al. 1991, section 4.4).

Every 30 ms the newest packet of predicted path is read at the instant for which the set-point is being computed, and an
alpha-beta-gamma filter smooths what is read. While no packet comes the path of the last one is followed to its end, and
beyond it the filter coasts.
"""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import KNOT_COUNT, Prediction, evaluate_prediction, message_size
from drake_tracker.estimation.alpha_beta_gamma import (
    AlphaBetaGammaGains,
    abg_predict,
    abg_step,
    alpha_beta_gamma_gains,
)

RESTART_DISTANCE = 0.10
"""A reading farther than this [m] from the filter is another object or a new track: the filter starts again."""


@dataclass(frozen=True)
class ServoState:
    """Everything the servo remembers: the filter over (x, y, z, yaw), the packet held, when the newest one was first on
    the line and its stamp, how it stands."""

    due: float
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    packet: np.ndarray
    arrived: float
    newest: float
    stale: bool
    valid: bool

    def __deepcopy__(self, memo):
        return self


class Servo:
    """Arithmetic of the trajectory generator.

    Args:
      tracking_index: of the alpha-beta-gamma filter of the position; .01 lags by 1 mm on a bend at 0.2 m/s.
      yaw_tracking_index: the same for the direction, which is noisier and changes more steadily.
      stale_after: time [s] without a new packet after which the target is called stale.
      coast: time [s] past the end of the last packet's path for which the target stays valid.
      lead: from the tick to the instant for which its set-point is due [s].
    """

    def __init__(self, tracking_index=0.01, yaw_tracking_index=0.003, stale_after=0.2, coast=0.3, lead=0.0):
        position, yaw = alpha_beta_gamma_gains(tracking_index), alpha_beta_gamma_gains(yaw_tracking_index)
        self.gains = AlphaBetaGammaGains(*(np.array([p, p, p, y]) for p, y in zip(position, yaw)))
        self.stale_after = stale_after
        self.coast = coast
        self.lead = lead

    def initial_state(self):
        zero = read_only(np.zeros(4))
        packet = read_only(np.zeros(message_size(Prediction)))
        return ServoState(0.0, zero, zero, zero, packet, 0.0, 0.0, True, False)

    def update(self, state, time, packet, frozen):
        """Returns the state after the tick at ``time`` [s].

        ``packet`` is the newest `Prediction` vector on the line; with ``frozen`` it is left there, and the path held
        already is followed.
        """
        packet = np.asarray(packet)
        due = time + self.lead
        held, arrived, newest = state.packet, state.arrived, state.newest
        if _is_newer(packet, newest):
            arrived, newest = time, float(packet[0])
        if not frozen and _is_newer(packet, held[0]):
            held = read_only(packet.copy())
        if not Prediction(held).valid:
            return ServoState(due, state.x, state.v, state.a, held, arrived, newest, True, False)
        stale = not frozen and time - arrived > self.stale_after
        end = held[2] + held[3] * (KNOT_COUNT - 1)
        if due <= end:
            measurement = evaluate_prediction(held, due)[:4]
            x, v, a = self._correct(state, measurement, due, held)
        else:  # nothing to measure against: constant velocity, since an old acceleration would run away
            x, v, a = abg_predict(state.x, state.v, np.zeros(4), due - state.due)
        valid = due <= end + self.coast
        return ServoState(due, read_only(x), read_only(v), read_only(a), held, arrived, newest, stale, valid)

    def _correct(self, state, measurement, due, held):
        measurement = measurement.copy()
        measurement[3] += 2 * np.pi * np.round((state.x[3] - measurement[3]) / (2 * np.pi))
        if not state.valid or np.linalg.norm(measurement[:3] - state.x[:3]) > RESTART_DISTANCE:
            dt = held[3]
            knots = [evaluate_prediction(held, due + k * dt)[:4] for k in (-1, 0, 1)]
            return measurement, (knots[2] - knots[0]) / (2 * dt), (knots[2] - 2 * knots[1] + knots[0]) / dt**2
        return abg_step(state.x, state.v, state.a, measurement, due - state.due, self.gains)

    def target(self, state):
        """Returns the `ServoTarget` vector of a state."""
        held = state.packet
        std = evaluate_prediction(held, state.due)[4] if state.valid else 0.0
        return np.concatenate(
            [[state.due], state.x, state.v, [held[0], held[1], std, float(state.stale), float(state.valid)]]
        )


def _is_newer(packet, stamp):
    fields = Prediction(packet)
    return bool(fields.valid) and fields.stamp > stamp and bool(np.all(np.isfinite(packet)))
