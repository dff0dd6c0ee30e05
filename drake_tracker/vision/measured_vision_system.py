"""The stand-in for cameras and image processing: the true pose with the measured error, as late as the centroid."""

import math

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_tracker.core.messages import TrackPoint, message_size
from drake_tracker.core.timing import VISION_PERIOD

TRUTH_PORT = "truth_train_state"
"""The one input by which a controller's room may read truth, and only when the scenario says ``vision: !Measured``."""


class MeasuredErrorSystem(LeafSystem):
    """Puts the measured error on the train's true pose.

    .. pydrake_system::

        name: MeasuredErrorSystem
        input_ports:
        - truth_train_state
        output_ports:
        - point

    ``truth_train_state``: the free body's 13 numbers in W: quaternion w, x, y, z, position [m], angular velocity
    [rad/s], velocity [m/s]. ``point`` is a `TrackPoint` of this very cycle, without the lag: zeros before the first
    cycle, invalid where nothing is seen or the point lies outside the ``work_volume`` by more than ``margin`` [m].
    There is no state; the errors are a function of the seed, the cycle and the train's state.

    Args:
      error: a `MeasuredError`. work_volume: lower and upper corner in W, (2, 3) [m]. seed: of all random numbers.
    """

    def __init__(self, error, work_volume, seed, *, margin=0.05, period=VISION_PERIOD):
        super().__init__()
        self._error, self._seed, self._period = error, int(seed), period
        lower, upper = np.asarray(work_volume, dtype=float)
        self._box = (lower - margin, upper + margin)
        self._truth = self.DeclareVectorInputPort(TRUTH_PORT, 13)
        self.DeclareVectorOutputPort(
            "point", message_size(TrackPoint), self._calc_point, {self.time_ticket(), self._truth.ticket()}
        )

    def _calc_point(self, context, output):
        cycle = round(context.get_time() / self._period)
        point = TrackPoint(np.zeros(message_size(TrackPoint)))
        if cycle > 0:
            point.stamp = cycle * self._period
            qw, qx, qy, qz, x, y, z, _, _, yaw_rate, vx, vy, _ = self._truth.Eval(context)
            yaw = math.atan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
            error = self._error.at(self._seed, cycle, (x, y), yaw, math.hypot(vx, vy), yaw_rate)
            if error is not None:
                p_WQ = error + (x, y, z)
                if np.all(p_WQ >= self._box[0]) and np.all(p_WQ <= self._box[1]):
                    point.x, point.y, point.z = p_WQ
                    point.valid = 1.0
        output.SetFromVector(point[:])


class MeasuredVisionDiagram(Diagram):
    """Takes the place of `VisionDiagram` in a scenario with ``vision: !Measured``: no image is rendered or processed.

    .. pydrake_system::

        name: MeasuredVisionDiagram
        input_ports:
        - truth_train_state
        output_ports:
        - point

    ``point`` is the `TrackPoint` of ``lag_cycles`` cycles ago, its stamp the time of that capture, read in the same
    slot as that of the rendered vision. With 0 cycles it is of the present one, which no camera could do.

    Unlike cameras this does not go blind when the hand comes between, and sees the train hanging in the hand where it
    hangs. The loop uses no vision from the start of the descent on, so that only a look at the points of that time in
    the log tells the difference.

    Args:
      error: a `MeasuredError`. lag_cycles: cycles from capture to point, from 0. work_volume: box in W [m]. seed.
    """

    def __init__(self, error, lag_cycles, work_volume, seed, *, period=VISION_PERIOD):
        super().__init__()
        self.set_name("vision")
        builder = DiagramBuilder()
        system = builder.AddNamedSystem("measured_error", MeasuredErrorSystem(error, work_volume, seed, period=period))
        lag = builder.AddNamedSystem("lag", DiscreteTimeDelay(period, lag_cycles, message_size(TrackPoint)))
        builder.ExportInput(system.GetInputPort(TRUTH_PORT), TRUTH_PORT)
        builder.Connect(system.GetOutputPort("point"), lag.get_input_port())
        builder.ExportOutput(lag.get_output_port(), "point")
        builder.BuildInto(self)
