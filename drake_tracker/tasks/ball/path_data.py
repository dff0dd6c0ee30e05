"""The values of a run of the ball that several parts of its picture need."""

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, Normalize

from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.tasks.ball.setup import BallSetup
from drake_tracker.tasks.ball.summary import last_verdict, over_the_cup
from drake_tracker.tasks.episode import Log, fresh_packets, phase_spans
from drake_tracker.tasks.style import FAR_PREDICTED

WARM = LinearSegmentedColormap.from_list("warm", ["#7a2b00", FAR_PREDICTED, "#e69f00", "#f7dfa5"])
"""Colours of predictions: dark shortly before the crossing, pale long before."""
LONG_BEFORE = 1.5
"""Time before the crossing at which the colour is palest [s]."""
BEFORE, AFTER = 0.35, 1.1
"""Time shown before the release and after the crossing [s]."""


class RunOfTheBall:
    """A run of the ball, as its picture needs it.

    Args:
        hand_eye: the diagram of the run.
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        log: {name: Signal} of the run.
        laboratory: the true laboratory.
        X_BW: pose of the world in the true frame of the board.
        half_width: half the width of the board [m].
        spans: phases of the run.
        verdict: the last findings of the judge, a `CatchVerdict`.
        released: time of the release [s], or None.
        crossing: time at which the ball crossed the bottom edge [s], or None.
        over_the_cup: x_B at which the ball passes over the cup [m], or None.
        shown: start and end of the time axes [s].
        packets: all packets that predict a crossing.
        times: times at which these packets arrived [s], shape (n,).
        predicted: predicted crossings of the packets: x_B [m], time [s], standard deviation [m]; shape (n, 3).
    """

    def __init__(self, hand_eye: HandEyeDiagram, setup: BallSetup, log: Log) -> None:
        self.log, self.laboratory = log, hand_eye.world.laboratory
        self.X_BW, self.half_width = self.laboratory.X_WB.inverse(), 0.5 * setup.scenario.board.width
        self.spans = phase_spans(log, CatchPhase, setup.scenario.time_step)
        self.verdict = last_verdict(log)
        self.released = float(self.verdict.released) or None
        self.crossing = float(self.verdict.crossing_time) or None
        self.over_the_cup = over_the_cup(hand_eye, setup, log, self.verdict) if self.crossing else None
        end = self.spans[-1].end if self.spans else 0.1
        start = max(self.released - BEFORE, 0.0) if self.released else 0.0
        self.shown = (start, max(min(end, self.crossing + AFTER) if self.crossing else end, start + 0.1))
        delivered, edge = log["delivered"], setup.edge
        packets, times, predicted = [], [], []
        for k in fresh_packets(delivered):
            crossing = edge.crossing(delivered.data[k])
            if crossing is not None and crossing.time > delivered.times[k]:
                x, _, _ = self.X_BW @ crossing.p_WQ
                packets.append(delivered.data[k])
                times.append(delivered.times[k])
                predicted.append((x, crossing.time, crossing.std))
        self.packets, self.times, self.predicted = packets, np.array(times), np.reshape(predicted, (-1, 3))

    def on_board(self, p_WQ: np.ndarray) -> np.ndarray:
        """Returns points in the frame of the board [m], shape (n, 3), from points in W [m]."""
        return (self.X_BW @ np.reshape(p_WQ, (-1, 3)).T).T

    def ball(self, times: np.ndarray) -> np.ndarray:
        """Returns the true (x, y)_B of the ball [m], shape (n, 2), at given times [s], shape (n,)."""
        truth = self.log["truth_ball_state"]
        if len(truth.times) == 0:
            return np.full((len(times), 2), np.nan)
        return self.on_board(np.column_stack([np.interp(times, truth.times, truth[axis]) for axis in "xyz"]))[:, :2]

    @property
    def colours(self) -> np.ndarray:
        """Colours of the packets, by the time from their arrival to the predicted crossing, shape (n, 4)."""
        return WARM(Normalize(0.0, LONG_BEFORE)(self.predicted[:, 1] - self.times))

    @property
    def end_of_roll(self) -> float:
        """Time of the crossing, or the end of the time axes when there was none [s]."""
        return self.crossing or self.shown[1]
