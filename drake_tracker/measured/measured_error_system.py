"""The stand-in for cameras and image processing: the true pose plus the measured error."""

import math

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_tracker.core.messages import TrackPoint, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.measured_error import MeasuredError, object_seed

TRUTH_PORT = "truth_train_state"
"""The only input through which a subsystem of the controller may read truth, and only with ``vision: !Measured``."""
OBJECTS_PORT = "truth_object_states"
"""The same for further objects, only with ``vision: !Measured {method: !SeveralObjects {}}``."""
_STATE_SIZE = 13


class MeasuredErrorSystem(LeafSystem):
    """Adds the measured error to the true pose of the train, or of a further object.

    .. pydrake_system::

        name: MeasuredErrorSystem
        input_ports:
        - truth_train_state
        output_ports:
        - point

    ``truth_train_state`` has the free body's 13 elements in W: quaternion w, x, y, z, position [m], angular velocity
    [rad/s], velocity [m/s]. For a further object there is ``truth_object_states`` instead, with as many elements for
    each of these objects. ``point`` is a `TrackPoint` vector in W [m] of the present cycle, without the lag: zeros
    before the first cycle, invalid where nothing is seen or the point lies outside the work volume by more than
    ``margin``. There is no state; the errors are a function of the seed, the cycle and the object's state.

    Args:
        error: `MeasuredError`.
        work_volume: lower and upper corner in W, shape (2, 3) [m].
        seed: of all random numbers.
        margin: by which a point may lie outside the work volume [m].
        period: of a cycle [s].
        number: of the object: 0 for the first train, 1 for the first further object.
        further: number of further objects, whose states ``truth_object_states`` has.
    """

    def __init__(
        self,
        error: MeasuredError,
        work_volume: ArrayLike,
        seed: int,
        *,
        margin: float = 0.05,
        period: float = VISION_PERIOD,
        number: int = 0,
        further: int = 0,
    ) -> None:
        super().__init__()
        self._error, self._seed, self._period = error, object_seed(int(seed), number), period
        lower, upper = np.asarray(work_volume, dtype=float)
        self._box = (lower - margin, upper + margin)
        name, count, row = (OBJECTS_PORT, further, number - 1) if number else (TRUTH_PORT, 1, 0)
        self._truth = self.DeclareVectorInputPort(name, _STATE_SIZE * count)
        self._row = slice(_STATE_SIZE * row, _STATE_SIZE * (row + 1))
        self.DeclareVectorOutputPort(
            "point", message_size(TrackPoint), self._calc_point, {self.time_ticket(), self._truth.ticket()}
        )

    def _calc_point(self, context: Context, output: BasicVector) -> None:
        cycle = round(context.get_time() / self._period)
        point = TrackPoint(np.zeros(message_size(TrackPoint)))
        if cycle > 0:
            point.stamp = cycle * self._period
            qw, qx, qy, qz, x, y, z, _, _, yaw_rate, vx, vy, _ = self._truth.Eval(context)[self._row]
            yaw = math.atan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
            error = self._error.at(self._seed, cycle, (x, y), yaw, math.hypot(vx, vy), yaw_rate)
            if error is not None:
                p_WQ = error + (x, y, z)
                if np.all(p_WQ >= self._box[0]) and np.all(p_WQ <= self._box[1]):
                    point.x, point.y, point.z = p_WQ
                    point.valid = 1.0
        output.SetFromVector(point[:])
