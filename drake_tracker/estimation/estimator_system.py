"""The estimator as a Drake System: points in, packets of predicted path out."""

import math
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, OutputPort, State

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
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
from drake_tracker.estimation.estimator import Estimator, EstimatorState
from drake_tracker.estimation.point_check import FARTHEST, refuse_point


@dataclass(frozen=True)
class EstimatorMemory(FrozenState):
    """State of an `EstimatorSystem`.

    Attributes:
        estimate: state of the estimator.
        stamp: newest stamp offered to the estimator [s].
        seq: number of packets made so far.
        packet: the newest `Prediction` vector, read-only.
        filtered: the newest `Filtered` vector, read-only.
        number: identity of the object, 0 without one.
    """

    estimate: EstimatorState
    stamp: float
    seq: int
    packet: np.ndarray
    filtered: np.ndarray
    number: int = 0


class EstimatorSystem(LeafSystem):
    """Runs an estimator once per vision cycle and outputs its predictions.

    .. pydrake_system::

        name: EstimatorSystem
        input_ports:
        - point
        output_ports:
        - prediction
        - filtered

    - ``point``: a `TrackPoint` [s, m], read at each update. The estimator sees no point when it is invalid, all zeros,
      not newer than the last one, or cannot be right (`drake_tracker.estimation.point_check.refuse_point`).
    - ``prediction``: a `Prediction` [s, m, rad], updated at each new point from which the estimator is ready. Its first
      knot is at the stamp of the newest point, and ``seq`` counts the packets. Without new points the last packet
      stays, and its stamp shows its age. All zeros: no prediction yet.
    - ``filtered``: a `Filtered` [s, m, rad, m/s], updated with ``prediction``, for logs. All zeros: no prediction yet.

    The System is updated every ``period``, after ``offset``: by default every `VISION_PERIOD`, a quarter of a plant
    step after the images. Both outputs depend on the state alone.

    With ``numbered`` there is one more input, ``number``: the identity of the measured object. When the identity
    changes, the estimator starts again, and the outputs are all zeros.

    Args:
        estimator: the estimator.
        period: period of the update [s].
        offset: time of the first update [s].
        farthest: largest coordinate of a point that can be right [m]; infinite where any unit of length may be used.
        numbered: whether there is the input ``number``.

    Raises:
        DrakeTrackerError: at an update, when the estimator, which may be a custom one, predicts something that is not
            finite or not of the shape that `Estimator` describes.
    """

    def __init__(
        self,
        estimator: Estimator[Any],
        *,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(ESTIMATOR_SLOT),
        farthest: float = FARTHEST,
        numbered: bool = False,
    ) -> None:
        super().__init__()
        self._estimator = estimator
        self._period, self._farthest = period, farthest
        self._blank = EstimatorMemory(
            estimate=estimator.initial_state(),
            stamp=-math.inf,
            seq=0,
            packet=read_only(np.zeros(message_size(Prediction))),
            filtered=read_only(np.zeros(message_size(Filtered))),
        )
        state = self.DeclareAbstractState(AbstractValue.Make(self._blank))
        self._point = self.DeclareVectorInputPort("point", message_size(TrackPoint))
        self._number = self.DeclareVectorInputPort("number", 1) if numbered else None
        outputs = {"prediction": (Prediction, attrgetter("packet")), "filtered": (Filtered, attrgetter("filtered"))}
        declare_outputs(self, state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        memory = state.get_abstract_state(0).get_value()
        number = 0 if self._number is None else int(self._number.Eval(context)[0])
        if number not in (0, memory.number):
            memory = replace(self._blank, seq=memory.seq, number=number)
            state.get_mutable_abstract_state(0).set_value(memory)
        values = self._point.Eval(context)
        if refuse_point(values, context.get_time(), self._period, self._farthest):
            return
        point = TrackPoint(values)
        # Compared with the System's own stamp, because an estimator need not accept a point or keep its stamp.
        newer = point.valid and point.stamp > memory.stamp
        p_WQ = np.array([point.x, point.y, point.z]) if newer else None
        estimate = self._estimator.update(memory.estimate, point.stamp, p_WQ)
        if estimate is memory.estimate and not newer:
            return
        stamp = point.stamp if newer else memory.stamp
        if estimate is not memory.estimate and self._estimator.ready(estimate):
            memory = self._predict(estimate, stamp, memory)
        else:
            memory = replace(memory, estimate=estimate, stamp=stamp)
        state.get_mutable_abstract_state(0).set_value(memory)

    def _predict(self, estimate: EstimatorState, stamp: float, before: EstimatorMemory) -> EstimatorMemory:
        """Returns the memory with the next packet, made from ``estimate`` after the point of ``stamp`` [s]."""
        seq = before.seq + 1
        packet, filtered = make_packet(self._estimator, estimate, seq)
        return EstimatorMemory(estimate, stamp, seq, packet, filtered, before.number)


def make_packet(estimator: Estimator[Any], estimate: EstimatorState, seq: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the packet of a state that is ready, and its filtered state: a `Prediction` and a `Filtered`, read-only.

    Raises DrakeTrackerError when the estimator predicts something that is not finite, or of another shape.
    """
    knots = np.column_stack(predict_path(estimator, estimate, estimate.stamp + KNOT_SPACING * np.arange(KNOT_COUNT)))
    packet = pack_prediction(estimate.stamp, seq, knots)
    speed = np.linalg.norm(knots[1, :3] - knots[0, :3]) / KNOT_SPACING
    filtered = np.concatenate([[estimate.stamp], knots[0, :4], [speed, 1.0]])
    return read_only(packet), read_only(filtered)


def predict_path(
    estimator: Estimator[Any], estimate: EstimatorState, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the predicted path (n, 4) [m, rad] and its standard deviation (n,) [m] at times (n,) [s].

    Args:
        estimator: the estimator.
        estimate: its state, which is ready.
        times: absolute times [s].

    Raises DrakeTrackerError when the estimator predicts something that is not finite, or of another shape.
    """
    return _evaluate(estimator, "predict", estimate, times, 4), _evaluate(estimator, "predict_std", estimate, times)


def _evaluate(
    estimator: Estimator[Any], method: str, estimate: EstimatorState, times: np.ndarray, *columns: int
) -> np.ndarray:
    """Returns the estimator's prediction for ``times`` (n,) [s], of shape (n, *columns).

    Raises DrakeTrackerError when the estimator returns another shape or a number that is not finite.
    """
    rows = np.asarray(getattr(estimator, method)(estimate, times), dtype=float)
    shape = (len(times), *columns)
    if rows.shape == shape and np.isfinite(rows).all():
        return rows
    wrong = f"the shape {rows.shape}, not {shape}" if rows.shape != shape else "a number that is not finite"
    name = f"{type(estimator).__name__}.{method}"
    raise DrakeTrackerError(f"{name} returned {wrong} after the point of {estimate.stamp:.3f} s")


def add_estimator(
    builder: DiagramBuilder,
    *,
    estimator: Estimator[Any],
    point: OutputPort | None = None,
    period: float = VISION_PERIOD,
    offset: float = vision_slot(ESTIMATOR_SLOT),
    name: str = "estimator",
) -> EstimatorSystem:
    """Adds an `EstimatorSystem` to a diagram, connects it, and returns it.

    Args:
        builder: builder of the diagram.
        estimator: the estimator, for example one of `make_estimator`.
        point: output port with `TrackPoint` messages; None: the caller connects the input ``point``.
        period: period of the update [s].
        offset: time of the first update [s]; later in the cycle than the update of ``point``.
        name: name of the System.
    """
    system = builder.AddNamedSystem(name, EstimatorSystem(estimator, period=period, offset=offset))
    if point is not None:
        builder.Connect(point, system.GetInputPort("point"))
    return system
