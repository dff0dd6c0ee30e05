"""The estimator as a Drake System: points in, packets of predicted path out."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    Filtered,
    Prediction,
    TrackPoint,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot


@dataclass(frozen=True)
class EstimatorMemory:
    """The System's state: that of the estimator, the newest stamp offered to it [s], the packets made so far, and the
    two output vectors (read-only)."""

    estimate: Any
    stamp: float
    seq: int
    packet: np.ndarray
    filtered: np.ndarray

    def __deepcopy__(self, memo):
        return self


class EstimatorSystem(LeafSystem):
    """Runs an estimator once per vision cycle and sends what it predicts.

    .. pydrake_system::

        name: EstimatorSystem
        input_ports:
        - point
        output_ports:
        - prediction
        - filtered

    - ``point``: a `messages.TrackPoint`; a point that is invalid or not newer than the last one is no point.
    - ``prediction``: a `messages.Prediction`; its first knot is at the stamp of the newest point.  ``seq`` counts the
      packets, one per new point; while no new point comes the last packet stays, and its stamp tells its age.
    - ``filtered``: a `Filtered`, for logs.

    The update is an unrestricted one every ``timing.VISION_PERIOD``, a quarter of a plant step after the images.  Both
    outputs depend on the state alone.

    The update raises DrakeTrackerError when the estimator, which may be the user's own, predicts something that is not
    finite, or of another shape than `drake_tracker.estimation` says.
    """

    def __init__(self, estimator, *, period=VISION_PERIOD, offset=vision_slot(ESTIMATOR_SLOT)):
        """``estimator``: one made by `drake_tracker.estimation.make_estimator`; period and offset in [s]."""
        super().__init__()
        self._estimator = estimator
        memory = EstimatorMemory(
            estimate=estimator.initial_state(),
            stamp=-math.inf,
            seq=0,
            packet=read_only(np.zeros(message_size(Prediction))),
            filtered=read_only(np.zeros(message_size(Filtered))),
        )
        state = self.DeclareAbstractState(AbstractValue.Make(memory))
        self._point = self.DeclareVectorInputPort("point", message_size(TrackPoint))
        ticket = {self.abstract_state_ticket(state)}
        self.DeclareVectorOutputPort("prediction", message_size(Prediction), self._calc_prediction, ticket)
        self.DeclareVectorOutputPort("filtered", message_size(Filtered), self._calc_filtered, ticket)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context, state):
        memory = state.get_abstract_state(0).get_value()
        point = TrackPoint(self._point.Eval(context))
        # The System's own memory: an estimator need not take what it is offered, nor keep its stamp.
        newer = point.valid and point.stamp > memory.stamp
        p_WQ = np.array([point.x, point.y, point.z]) if newer else None
        estimate = self._estimator.update(memory.estimate, point.stamp, p_WQ)
        if estimate is memory.estimate and not newer:
            return
        stamp = point.stamp if newer else memory.stamp
        if estimate is not memory.estimate and self._estimator.ready(estimate):
            memory = self._predict(estimate, stamp, memory.seq + 1)
        else:
            memory = replace(memory, estimate=estimate, stamp=stamp)
        state.get_mutable_abstract_state(0).set_value(memory)

    def _predict(self, estimate, stamp, seq):
        """Returns the memory with a new packet built on ``estimate``."""
        times = estimate.stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
        path, std = self._asked("predict", estimate, times, 4), self._asked("predict_std", estimate, times)
        knots = np.column_stack([path, std])
        packet = pack_prediction(estimate.stamp, seq, knots)
        speed = np.linalg.norm(knots[1, :3] - knots[0, :3]) / KNOT_SPACING
        filtered = np.concatenate([[estimate.stamp], knots[0, :4], [speed, 1.0]])
        return EstimatorMemory(estimate, stamp, seq, read_only(packet), read_only(filtered))

    def _asked(self, method, estimate, times, *columns):
        """Returns what the estimator, which may be the user's own, says of ``times``; raises DrakeTrackerError when
        that is of another shape or not finite."""
        rows = np.asarray(getattr(self._estimator, method)(estimate, times), dtype=float)
        shape = (len(times), *columns)
        if rows.shape == shape and np.isfinite(rows).all():
            return rows
        wrong = f"the shape {rows.shape}, not {shape}" if rows.shape != shape else "a number that is not finite"
        name = f"{type(self._estimator).__name__}.{method}"
        raise DrakeTrackerError(f"{name} returned {wrong} after the point of {estimate.stamp:.3f} s")

    def _calc_prediction(self, context, output):
        output.SetFromVector(context.get_abstract_state(0).get_value().packet)

    def _calc_filtered(self, context, output):
        output.SetFromVector(context.get_abstract_state(0).get_value().filtered)
