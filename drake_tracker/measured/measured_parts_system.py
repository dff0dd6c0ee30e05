"""The stand-in for cameras that see the parts on a belt: their true poses plus a random error."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_tracker.core.belt_frame import BeltFrame
from drake_tracker.core.messages import PART_FIELDS, PartTracks, message_rows, message_size
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.config import MeasuredParts

STREAM = 54
"""Stream of random numbers: default_rng([seed, STREAM, cycle])."""
PARTS_PORT = "truth_part_states"
"""The only input through which the controller of the conveyor may read truth, with ``vision: !Measured``."""
_STATE_SIZE = 13
_ON_BELT = 0.010
"""A part is on the belt up to this height above the place where it rests [m]."""
_TIPPED, _UNCLEAR = 0.7, 1.0
"""Cosine of the tilt beyond which a part lies on a side, and the variance with which it is then reported [m^2]."""
_HIGHEST = 0.035
"""Largest height of the origin of a part that lies on a side above the belt [m]."""


class MeasuredPartsSystem(LeafSystem):
    """Adds a random error to the true poses of the parts that are on the belt, in view.

    .. pydrake_system::

        name: MeasuredPartsSystem
        input_ports:
        - truth_part_states
        output_ports:
        - parts

    ``truth_part_states``: 13 numbers per part, as of a free body. ``parts``: a `PartTracks` of the present cycle,
    without the lag; when there are more parts in view than slots, those farthest downstream. There is no state.

    The error of each part is the sum of a constant, such as an error of its shape causes, and of noise that is drawn
    anew in every cycle. A part keeps its number: measured vision never confuses two parts. One that lies on a side has
    another number, since cameras do not recognize it.

    Args:
        settings: standard deviations of the errors.
        kinds: of all parts of the run.
        belt_height: z_W of the belt's upper face [m].
        view: lowest and highest corner (x, y) in W of the visible part of the belt, shape (2, 2) [m].
        seed: of all random numbers.
        frame: of the belt, in which the error is made, and in which ``belt_height`` and ``view`` are given.
        period: of a cycle [s].
    """

    def __init__(
        self,
        settings: MeasuredParts,
        kinds: Sequence[PartKind],
        *,
        belt_height: float,
        view: np.ndarray,
        seed: int,
        frame: BeltFrame = BeltFrame(),
        period: float = VISION_PERIOD,
    ) -> None:
        super().__init__()
        self._settings, self._kinds, self._height = settings, tuple(kinds), belt_height
        self._low, self._high = np.asarray(view, dtype=float)
        self._seed, self._period, self._frame = seed, period, frame
        self._constant = np.random.default_rng([seed, STREAM]).standard_normal((len(self._kinds), 3))
        self._truth = self.DeclareVectorInputPort(PARTS_PORT, _STATE_SIZE * len(self._kinds))
        self.DeclareVectorOutputPort(
            "parts", message_size(PartTracks), self._calc, {self.time_ticket(), self._truth.ticket()}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        cycle = round(context.get_time() / self._period)
        vector = np.zeros(message_size(PartTracks))
        if cycle > 0:
            header = PartTracks(vector)
            header.stamp, header.valid = cycle * self._period, 1.0
            states = self._on_belt(self._truth.Eval(context).reshape(-1, _STATE_SIZE))
            seen = self._visible(states)
            slots = message_rows(vector, PART_FIELDS)
            seen = sorted(seen, key=lambda k: -states[k, 5])[: len(slots)]
            random = np.random.default_rng([self._seed, STREAM, cycle]).standard_normal((len(self._kinds), 3))
            for slot, k in zip(slots, seen):
                slot[:] = self._row(k, states[k], random[k], header.stamp)
                slot[2:6] = self._frame.to_world(slot[None, 2:6])[0]
        output.SetFromVector(vector)

    def _on_belt(self, states: np.ndarray) -> np.ndarray:
        """Returns the states with orientations and places in the frame of the belt."""
        if self._frame.angle == 0.0:
            return states
        states = states.copy()
        states[:, 4:7] = self._frame.to_belt(np.column_stack([states[:, 4:7], np.zeros(len(states))]))[:, :3]
        c, s = np.cos(0.5 * self._frame.angle), -np.sin(0.5 * self._frame.angle)
        w, x, y, z = states[:, :4].T.copy()
        states[:, :4] = np.column_stack([c * w - s * x, c * x + s * w, c * y - s * z, c * z + s * y])
        return states

    def _visible(self, states: np.ndarray) -> list[int]:
        """Returns the parts that lie on the belt, in view."""
        rest = self._height + 0.5 * np.array([PART_SHAPES[kind].height for kind in self._kinds])
        xy = states[:, 4:6]
        inside = ((xy >= self._low) & (xy <= self._high)).all(axis=1)
        stands = np.abs(states[:, 6] - rest) <= _ON_BELT
        lies = (_upright(states) < _TIPPED) & (states[:, 6] >= self._height) & (states[:, 6] <= self._height + _HIGHEST)
        return np.flatnonzero(inside & (stands | lies)).tolist()

    def _row(self, k: int, state: np.ndarray, random: np.ndarray, stamp: float) -> list[float]:
        """Returns the slot of part k, whose number is k + 1; on a side, it is larger by the number of parts."""
        settings = self._settings
        qw, qx, qy, qz, x, y, z = state[:7]
        yaw = np.arctan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
        bias, noise = settings.bias_std, settings.noise_std
        turn_bias, turn_noise = np.deg2rad(settings.turn_bias_std_deg), np.deg2rad(settings.turn_noise_std_deg)
        dx, dy = bias * self._constant[k, :2] + noise * random[:2]
        turn = turn_bias * self._constant[k, 2] + turn_noise * random[2]
        number, variance = k + 1, noise**2
        if _upright(state) < _TIPPED:
            number, variance = number + len(self._kinds), _UNCLEAR
        kind = self._kinds[k]
        return [number, kind, x + dx, y + dy, z, yaw + turn, variance, variance, max(turn_noise, 1e-3) ** 2, stamp]


def _upright(states: np.ndarray) -> np.ndarray:
    """Returns the cosine of the tilt of free bodies, shape (...), for their 13 numbers, shape (..., 13)."""
    square = states[..., :4] ** 2
    return (square[..., 0] + square[..., 3] - square[..., 1] - square[..., 2]) / square.sum(axis=-1)
