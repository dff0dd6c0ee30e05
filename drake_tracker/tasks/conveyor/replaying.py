"""The time in which the predictions of a run of the conveyor are judged, and of which part they are."""

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import packet_target
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.conveyor.part_history import tracks_of
from drake_tracker.tasks.episode import Log, during, phase_spans
from drake_tracker.tasks.plots import LONG

FOLLOWING = (PickPhase.TRACK, PickPhase.INTERCEPT)
"""Phases in which the hand follows a part that lies on the belt."""


def with_target(log: Log, truth_signal: str) -> dict[str, Signal]:
    """Returns a log in which the true state is that of the part that the arm has a packet about.

    Args:
        log: {name: Signal} of the run.
        truth_signal: name of the signal with the states of all parts, which is replaced: then its fields are x and y in
            W [m], NaN while there is no packet.
    """
    states = log[truth_signal]
    part = target_parts(log, states.times, len(log["truth_fates"].names))
    places = np.stack([states.view(f"x_{k}", f"y_{k}") for k in range(len(log["truth_fates"].names))], axis=1)
    xy = np.where(part[:, None] >= 0, places[np.arange(len(part)), np.maximum(part, 0)], np.nan)
    return {**log, truth_signal: Signal(states.times, xy, ("x", "y"))}


def target_parts(log: Log, times: np.ndarray, count: int) -> np.ndarray:
    """Returns which part the newest packet of the arm describes at times, from 0, -1 for none, shape (n,).

    Args:
        log: {name: Signal} of the run.
        times: (n,) [s].
        count: number of parts.
    """
    part_of = {number: k for k, numbers in enumerate(tracks_of(log, count)) for number in numbers}
    packets = log["delivered"]
    found = [part_of.get(packet_target(seq), -1) if valid else -1 for seq, valid in packets.view("seq", "valid")]
    return np.array(found)[np.clip(np.searchsorted(packets.times, times, side="right") - 1, 0, None)]


class PickFreeMotion:
    """The time in which the part that the hand follows lies on the belt.

    While the arm turns to another part, a prediction may be about one and the true path about the other. It is judged
    only once the part has been the same for the whole time from the oldest packet that predicts this instant.

    Args:
        scenario: the scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        spans: phases of the run.
    """

    def __init__(self, scenario: BaseScenario, log: Log) -> None:
        self.spans = phase_spans(log, PickPhase, scenario.time_step)
        times = log["delivered"].times
        part = target_parts(log, times, len(log["truth_fates"].names))
        changes = times[1:][np.diff(part) != 0]
        self._changed = np.concatenate([[-np.inf], changes])

    def free(self, times: np.ndarray) -> np.ndarray:
        since = times - self._changed[np.searchsorted(self._changed, times, side="right") - 1]
        return during(self.spans, times, *FOLLOWING) & (since > LONG)

    def tracked(self, times: np.ndarray) -> np.ndarray:
        return self.free(times)

    def observed(self, times: np.ndarray) -> np.ndarray:
        return np.ones(len(times), dtype=bool)
