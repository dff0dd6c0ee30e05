"""Evidence from the log of a run about each attempt, and about moments of tracking at which an attempt could have
started."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY
from drake_tracker.arm.motion.transform_equation import share_done
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import Prediction, evaluate_prediction, prediction_end
from drake_tracker.core.timing import ESTIMATOR_SLOT, SERVO_PERIOD, VISION_PERIOD, vision_slot
from drake_tracker.grasp.config import touch_delay
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.report.failure_diagnosis.chain import Packets, chain, in_train
from drake_tracker.report.failure_diagnosis.reference_estimate import point_rows, refilter, seen_by, true_points
from drake_tracker.report.failure_diagnosis.stages import Stage
from drake_tracker.tasks.episode import PhaseSpan, during, fresh_packets, tool_pose
from drake_tracker.tasks.train.episode import train_pose
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, true_camera_models

REHEARSE_EVERY = 0.24
"""Time [s] from one evaluated moment of tracking to the next."""
MOTION_DELAY = (SPLINE_DELAY - 1.0) * SERVO_PERIOD
"""Time [s] from the launch until the hand starts to move: the spline's delay minus the period by which a motion starts
ahead."""
TOUCH_AFTER_DESCENT = 0.06
"""Planned time [s] from the end of the descent until the pads touch, with the default settings."""
BEFORE_CONTACT = 2.0 * VISION_PERIOD
"""Time [s] before a logged contact at which the train was certainly undisturbed; the log is up to a cycle late."""
ONSET = 0.002
"""The jaws have started to close once they are this much [m] narrower than open."""


class Attempt(NamedTuple):
    """One descent of the hand.

    Attributes:
        number: from 1.
        launch: start of the descent [s].
        close: start of the closing [s], None when the jaws never started to close.
        end: of the attempt [s].
        meeting: when the jaws reached the train's width, or just before a first contact [s].
        jaws: when the jaws reached the train's width, or would have reached it [s].
        timing: of the jaws relative to the plan [s], positive late.
        rows: contributions along, across, up [m], yaw [rad], shape (7, 4); None where the log does not tell.
        ages: {stage: time that belongs to it [s]}.
        lifted: height [m] to which the train was lifted while a finger touched it.
        outcome: "lifted", "dropped", "missed", or "ended" when the run ended first.
    """

    number: int
    launch: float
    close: float | None
    end: float
    meeting: float
    jaws: float
    timing: float
    rows: np.ndarray | None
    ages: dict[Stage, float]
    lifted: float
    outcome: str


@dataclass(frozen=True)
class TrackingEvidence:
    """The same chain at many moments of tracking, as if the hand had been sent down then.

    Attributes:
        times: shape (n,) [s].
        rows: along, across, up [m], yaw [rad], shape (n, 7, 4). The servo's contribution is that at the moment itself,
            NaN while the hand was moving to the train.
        ages: of the packet in force, relative to the host's newest, shape (n,) [s].
    """

    times: np.ndarray
    rows: np.ndarray
    ages: np.ndarray


class Evidence:
    """Reads the log of a run; see `attempts` and `tracking`.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal}.
        spans: from `phase_spans`.
    """

    def __init__(self, setup: TrainSetup, log: Mapping[str, Signal], spans: Sequence[PhaseSpan]) -> None:
        self._grasp, self._log, self._spans = setup.grasp, log, spans
        self._launches = [span.start for span in spans if span.phase == Phase.INTERCEPT]
        prediction = log["prediction"]
        rows = fresh_packets(prediction)
        self._packets = prediction.data[rows]
        self._made = prediction.times[rows] - VISION_PERIOD + vision_slot(ESTIMATOR_SLOT, setup.scenario.time_step)
        self._by_seq = {int(Prediction(packet).seq): packet for packet in self._packets}
        verdict = log["truth_verdict"]
        contact = (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0) | (verdict["derailed"] > 0)
        self._contacts = verdict.times[contact]
        self._moments = self._moments_of_tracking()
        self._refilter(setup)

    def attempts(self) -> tuple[Attempt, ...]:
        """Returns the attempts, in order."""
        return tuple(self._attempt(number, launch) for number, launch in enumerate(self._launches, 1))

    def tracking(self) -> TrackingEvidence:
        """Returns the contributions at many moments of tracking."""
        log, blind = self._log, self._blind
        status = log["status"]
        times, rows, ages = [], [], []
        for moment in self._moments:
            basis = self._basis(moment)
            meeting = moment + blind
            if basis is None or self._touched(moment, meeting):
                continue
            (train_now, train), (hand,) = train_pose(log, [moment, meeting]), tool_pose(log, [moment])
            if np.isnan(train).any() or np.isnan(hand).any():
                continue
            held = _read(basis.held, meeting)
            found = in_train(chain(basis, meeting, train, held), train[3])
            k = np.searchsorted(status.times, moment, side="right") - 1
            there = status["fraction"][k] >= 1.0 and not status["flipping"][k]
            off = self._servo_now(basis, moment, train_now, hand)
            if prediction_end(basis.held) < moment <= prediction_end(basis.newest):
                found[Stage.LINK] += off  # the path had ended on the link: the servo had nothing to follow
            else:
                found[Stage.SERVO] = off if there else np.nan
            times.append(moment)
            rows.append(found)
            ages.append(_stamp(basis.newest) - _stamp(basis.held))
        return TrackingEvidence(np.array(times), np.array(rows).reshape(-1, len(Stage), 4), np.array(ages))

    @property
    def _blind(self) -> float:
        """Time from the launch until the pads touch [s]."""
        grasp = self._grasp
        return grasp.descent_duration - grasp.closing_lead + touch_delay(grasp)

    def _moments_of_tracking(self) -> np.ndarray:
        target = self._log["target"]
        good = (target["valid"] > 0) & during(self._spans, target.times, Phase.TRACK)
        return target.times[good][:: round(REHEARSE_EVERY / SERVO_PERIOD)]

    def _refilter(self, setup: TrainSetup) -> None:
        log = self._log
        stamps, points = point_rows(log)
        bases = [self._newest(moment) for moment in (*self._moments, *self._launches)]
        wanted = [_stamp(packet) for packet in bases if packet is not None]
        cameras = true_camera_models(setup.scenario.cameras)
        left, right = (cameras[name] for name in CAMERA_NAMES)
        truly = true_points(log, stamps)
        there = ~np.isnan(truly).any(axis=1)
        self._truly = refilter(stamps[there], truly[there], wanted)
        self._point = refilter(stamps, points, wanted)
        seen = seen_by((left, right), log, stamps, points)
        self._seen = self._point if np.array_equal(seen, points) else refilter(stamps, seen, wanted)

    def _newest(self, time: float) -> np.ndarray | None:
        """Returns the host's newest packet at a time [s], or None when there is none."""
        k = np.searchsorted(self._made, time, side="right") - 1
        return self._packets[k] if k >= 0 else None

    def _basis(self, time: float) -> Packets | None:
        """Returns the `Packets` behind a descent that starts at ``time`` [s]; None without a prediction in force."""
        target = self._log["target"]
        k = np.searchsorted(target.times, time)
        if k == len(target.times) or not target["valid"][k]:
            return None
        newest, held = self._newest(time), self._by_seq.get(int(target["seq"][k]))
        if newest is None or held is None:
            return None
        if _stamp(held) > _stamp(newest):  # logged at the end of the period in which it arrived
            newest = held
        key = round(_stamp(newest), 6)
        return Packets(self._truly.get(key), self._seen.get(key), self._point.get(key), newest, held)

    def _servo_now(self, basis: Packets, moment: float, train: np.ndarray, hand: np.ndarray) -> np.ndarray:
        """Returns the offset (along, across, up, yaw) of the hand from the train according to the packet in force."""
        hand = hand - [0.0, 0.0, self._grasp.hover_height, 0.0]
        off = hand - _read(basis.held, moment)
        off[3] -= np.pi * np.round(off[3] / np.pi)
        return in_train(off[None], train[3])[0]

    def _touched(self, start: float, end: float) -> bool:
        return bool(((self._contacts >= start) & (self._contacts <= end)).any())

    def _height(self, launch: float, time: float) -> float:
        """Returns the intended height [m] of the hand above the train at ``time`` [s]."""
        grasp = self._grasp
        done = share_done((time - launch - MOTION_DELAY) / grasp.descent_duration)
        return grasp.hover_height + (grasp.grasp_height - grasp.hover_height) * done

    def _attempt(self, number: int, launch: float) -> Attempt:
        grasp, spans = self._grasp, self._spans
        index = next(k for k, span in enumerate(spans) if span.phase == Phase.INTERCEPT and span.start == launch)
        own = [spans[index]]
        for span in spans[index + 1 :]:
            if span.phase in (Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT):
                break
            own.append(span)
        starts = {span.phase: span.start for span in reversed(own)}
        end = own[-1].end
        if own[-1] is spans[-1]:  # the last command is a little earlier than the end of the run
            end = max(end, self._log["truth_verdict"].times[-1])
        close = starts.get(Phase.CLOSE)
        plan = launch + grasp.descent_duration + TOUCH_AFTER_DESCENT
        jaws = self._jaws_closed(launch, min(end, starts.get(Phase.RETREAT, end)))
        touch = next((t for t in self._contacts if launch <= t <= end), np.inf)
        met = min(jaws, touch - BEFORE_CONTACT)
        meeting = min(met, plan)
        rows, ages = self._contributions(launch, meeting, met, jaws) if close is not None else (None, {})
        timing = jaws - plan
        if rows is not None:
            ages[Stage.TIMING] = timing
        return Attempt(number, launch, close, end, met, jaws, timing, rows, ages, *self._outcome(launch, end, starts))

    def _jaws_closed(self, launch: float, end: float) -> float:
        """Returns when the jaws reached the train's width [s], extrapolated from the first half of their travel.

        In the second half the train may stop them. Returns ``end`` when they never travelled that half.
        """
        grasp, jaws = self._grasp, self._log["jaws"]
        inside = (jaws.times >= launch) & (jaws.times <= end)
        times, width = jaws.times[inside], jaws["width"][inside]
        instants = []
        for level in (grasp.jaw_opening - ONSET, 0.5 * (grasp.jaw_opening + grasp.object_width)):
            below = np.nonzero(width <= level)[0]
            if len(below) == 0 or below[0] == 0:
                return end
            k = below[0]
            share = (width[k - 1] - level) / (width[k - 1] - width[k])
            instants.append(times[k - 1] + share * (times[k] - times[k - 1]))
        return instants[0] + 2.0 * (instants[1] - instants[0])

    def _contributions(
        self, launch: float, meeting: float, met: float, jaws: float
    ) -> tuple[np.ndarray | None, dict[Stage, float]]:
        """Returns (rows, ages) of an attempt, or (None, {}) where the log does not tell.

        The contribution of the timing is the drift of the hand from the end of the plan until it met the train, plus
        the height of the planned descent when the jaws reached the train's width. A finger that touches a train in the
        wrong place early does not count as early closing.
        """
        log, basis = self._log, self._basis(launch)
        trains, hands = train_pose(log, [meeting, met]), tool_pose(log, [meeting, met])
        if basis is None or np.isnan(trains).any() or np.isnan(hands).any():
            return None, {}
        train, hand = trains[0], hands[0] - [0.0, 0.0, self._height(launch, meeting), 0.0]
        rows = in_train(chain(basis, meeting, train, hand), train[3])
        whole = hands[1] - trains[1] - [0.0, 0.0, self._height(launch, met), 0.0]
        whole[3] -= np.pi * np.round(whole[3] / np.pi)
        rows[Stage.TIMING] = in_train(whole[None], trains[1, 3])[0] - rows.sum(axis=0)
        rows[Stage.TIMING, 2] += self._height(launch, jaws) - self._grasp.grasp_height
        speed = np.hypot(*(train_pose(log, [meeting - 0.05])[0, :2] - train[:2])) / 0.05
        ages = {
            Stage.VISION: launch - _stamp(basis.newest),
            Stage.PREDICTION: meeting - _stamp(basis.newest),
            Stage.LINK: _stamp(basis.newest) - _stamp(basis.held),
        }
        if speed > 0.01:
            ages |= {stage: -rows[stage, 0] / speed for stage in (Stage.FILTER, Stage.SERVO)}
        return rows, ages

    def _outcome(self, launch: float, end: float, starts: Mapping[IntEnum, float]) -> tuple[float, str]:
        """Returns (height [m], outcome) of an attempt."""
        verdict = self._log["truth_verdict"]
        touched = (verdict.times >= launch) & (verdict.times <= end)
        touched &= (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)
        height = max(verdict["lift"][touched], default=0.0)
        lifted = verdict["taken"][(verdict.times >= launch) & (verdict.times <= end + VISION_PERIOD)]
        if lifted.any():
            return height, "lifted"
        if Phase.RETREAT not in starts and self._spans[-1].end <= end:
            return height, "dropped" if verdict["derailed"].any() else "ended"
        return height, "dropped" if Phase.LIFT in starts else "missed"


def _stamp(packet: np.ndarray) -> float:
    return float(Prediction(packet).stamp)


def _read(packet: np.ndarray, time: float) -> np.ndarray:
    """Returns the predicted pose (x, y, z, yaw) at ``time`` [s]."""
    return evaluate_prediction(packet, time)[:4]
