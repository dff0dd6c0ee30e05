"""The trajectory generator's fixed-gain filter (Allen et al. 1991, section 4.4).

Every period the newest packet of predicted path is evaluated at the instant for which the set-point is computed, and an
alpha-beta-gamma filter smooths the result. While no packet arrives, the path of the last one is followed to its end;
beyond its end the filter coasts.
"""

from dataclasses import dataclass

import numpy as np

from drake_tracker.arm.config import ServoConfig
from drake_tracker.arm.motion.tool_motion import JUMP_DISTANCE
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import (
    KNOT_FIELDS,
    Frozen,
    Prediction,
    evaluate_prediction,
    message_size,
    packet_target,
    prediction_end,
    prediction_knots,
)
from drake_tracker.estimation.parts.alpha_beta_gamma_filter import (
    AlphaBetaGammaGains,
    abg_predict,
    abg_step,
    alpha_beta_gamma_gains,
)

RESTART_DISTANCE = 0.10
"""A prediction farther than this [m] from the filter is of another object or of a new track: the filter restarts. For a
packet about another object, `JUMP_DISTANCE` applies instead: the filter must not drift from one object to the other,
and the hand approaches an object anew that jumps by this distance."""


@dataclass(frozen=True)
class ServoState(FrozenState):
    """Everything the servo remembers.

    Attributes:
        due: time [s] for which the filter holds: the instant of the set-point.
        x: filtered (x, y, z, yaw) in W, shape (4,) [m, rad], yaw continuous.
        v: its rates, shape (4,) [m/s, rad/s].
        a: its accelerations, shape (4,) [m/s^2, rad/s^2].
        packet: the `Prediction` vector that is followed.
        arrived: time [s] at which the newest packet was first seen on the link.
        newest: stamp [s] of the newest packet on the link.
        stale: whether the newest packet is too old.
        valid: whether the pose can be followed.
    """

    due: float
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    packet: np.ndarray
    arrived: float
    newest: float
    stale: bool
    valid: bool


class Servo:
    """Arithmetic of the trajectory generator.

    Args:
        settings: the filter's tracking indices, and the age from which the target is stale.
        coast: time [s] past the end of the last packet's path for which the target stays valid.
        lead: time from the tick to the instant for which its set-point is due [s].
        yaw: direction in W of an object that does not turn with its path [rad]; None: it points along its path.
    """

    def __init__(
        self,
        settings: ServoConfig = ServoConfig(),
        *,
        coast: float = 0.3,
        lead: float = 0.0,
        yaw: float | None = None,
    ) -> None:
        self.gains = _gains(settings.tracking_index, settings.yaw_tracking_index)
        self.descent_gains = _gains(settings.descent_tracking_index, settings.descent_yaw_tracking_index)
        self.stale_after = settings.stale_after
        self.coast = coast
        self.lead = lead
        self.yaw = yaw

    def initial_state(self) -> ServoState:
        """Returns the state before the first packet."""
        zero = read_only(np.zeros(4))
        packet = read_only(np.zeros(message_size(Prediction)))
        return ServoState(0.0, zero, zero, zero, packet, 0.0, 0.0, True, False)

    def update(self, state: ServoState, time: float, packet: np.ndarray, frozen: Frozen) -> ServoState:
        """Returns the state after a tick.

        Args:
            state: the state before.
            time: time of the tick [s].
            packet: the newest `Prediction` vector on the link.
            frozen: BLIND: the held packet is followed, and newer packets are not used. GUIDED: the filter follows new
                packets about the same object quickly; the hand must not leave for another one in a descent.
        """
        blind = frozen == Frozen.BLIND
        packet = np.asarray(packet)
        due = time + self.lead
        held, arrived, newest = state.packet, state.arrived, state.newest
        if _is_newer(packet, newest):
            arrived, newest = time, float(Prediction(packet).stamp)
        other = False
        if not blind and _is_newer(packet, Prediction(held).stamp):
            other = packet_target(Prediction(packet).seq) != packet_target(Prediction(held).seq)
            if not (other and frozen == Frozen.GUIDED):
                held = packet.copy()
                if self.yaw is not None:
                    prediction_knots(held)[:, KNOT_FIELDS.index("yaw")] = self.yaw
                held = read_only(held)
        if not Prediction(held).valid:
            return ServoState(due, state.x, state.v, state.a, held, arrived, newest, True, False)
        stale = not blind and time - arrived > self.stale_after
        end = prediction_end(held)
        if due <= end:
            measurement = evaluate_prediction(held, due)[:4]
            x, v, a = self._correct(state, measurement, due, held, other, frozen)
        else:  # nothing to correct with: constant velocity, since an old acceleration would diverge
            x, v, a = abg_predict(state.x, state.v, np.zeros(4), due - state.due)
        valid = bool(due <= end + self.coast)
        return ServoState(due, read_only(x), read_only(v), read_only(a), held, arrived, newest, stale, valid)

    def target(self, state: ServoState) -> np.ndarray:
        """Returns the `ServoTarget` vector of a state."""
        held = Prediction(state.packet)
        std = evaluate_prediction(state.packet, state.due)[4] if state.valid else 0.0
        return np.concatenate(
            [[state.due], state.x, state.v, [held.stamp, held.seq, std, float(state.stale), float(state.valid)]]
        )

    def _correct(
        self, state: ServoState, measurement: np.ndarray, due: float, held: np.ndarray, other: bool, frozen: Frozen
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns x, v and a of the filter at ``due`` [s], corrected by the predicted pose, shape (4,).

        Args:
            state: the state before.
            measurement: the predicted pose.
            due: time for which the filter shall hold [s].
            held: the `Prediction` vector.
            other: whether it is the first packet about another object.
            frozen: as for `update`.
        """
        measurement = measurement.copy()
        measurement[3] += 2 * np.pi * np.round((state.x[3] - measurement[3]) / (2 * np.pi))
        jump = np.linalg.norm(measurement[:3] - state.x[:3])
        if not state.valid or jump > (JUMP_DISTANCE if other else RESTART_DISTANCE):
            dt = Prediction(held).spacing
            knots = [evaluate_prediction(held, due + k * dt)[:4] for k in (-1, 0, 1)]
            return measurement, (knots[2] - knots[0]) / (2 * dt), (knots[2] - 2 * knots[1] + knots[0]) / dt**2
        gains = self.descent_gains if frozen == Frozen.GUIDED else self.gains
        return abg_step(state.x, state.v, state.a, measurement, due - state.due, gains)


def _gains(position: float, yaw: float) -> AlphaBetaGammaGains:
    """Returns the gains of x, y, z and yaw, each of shape (4,), from the tracking indices of position and direction."""
    pairs = zip(alpha_beta_gamma_gains(position), alpha_beta_gamma_gains(yaw))
    return AlphaBetaGammaGains(*(np.array([p, p, p, y]) for p, y in pairs))


def _is_newer(packet: np.ndarray, stamp: float) -> bool:
    fields = Prediction(packet)
    return bool(fields.valid) and fields.stamp > stamp and bool(np.all(np.isfinite(packet)))
