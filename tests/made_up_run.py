"""A run that was never simulated: the log of a train on a straight track, with errors put in on purpose."""

from types import SimpleNamespace

import numpy as np
import pytest

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, pack_prediction
from drake_tracker.core.timing import ESTIMATOR_SLOT, GRASP_SLOT, SERVO_PERIOD, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.task import TASK

SPEED = 0.1
LAG = 15 * VISION_PERIOD
TRAIN_Z = 0.485


def straight_scenario():
    """A train that runs along +y at 0.1 m/s; with the default jaws it fits within 24 mm across."""
    return load_scenario("train:learned", seed=5).with_settings(
        {
            "name": "straight",
            "track.kind": "line",
            "track.direction": "forward",
            "track.centre_range": 0.0,
            "track.rotation_range_deg": 0.0,
            "track.speed": SPEED,
        }
    )


def tick(time):
    """The instant at which the grasp machine gives the command that the log first shows at ``time``."""
    return time - (1.0 - GRASP_SLOT) * TIME_STEP


class Episode:
    """Makes logs of a run of ``duration`` s.

    ``phases``: (phase, time at which the log first shows it), in order. ``beside(t)``: how far to the left of the track
    [m] the train is predicted at time t, by every packet, and hence where the hand goes. ``turned``: angle from the
    hand to the train [rad]. ``offsets(t)``: error (along, across) of the point seen at time t. ``verdict``: fields of
    the Verdict over time, as functions.
    """

    def __init__(self, scenario):
        self.scenario = scenario
        self.duration = 6.0
        self.phases = [(Phase.ACQUIRE, 0.0), (Phase.TRACK, 1.02)]
        self.beside = lambda t: 0.0 * t
        self.turned = 0.0
        self.offsets = lambda t: np.zeros((len(t), 2))
        self.valid = lambda t: np.ones(len(t))
        self.gate = Gate.NO_MEMORY
        self.verdict = {}
        track, self.start = resolve(scenario).placement
        self.x, self.y, self.yaw = (float(c) for c in track.pose(self.start))

    def place(self, t):
        """True (x, y) of the train at times t."""
        return np.column_stack([np.full(len(t), self.x), self.y + SPEED * t])

    def log(self):
        cycles = VISION_PERIOD * np.arange(round(self.duration / VISION_PERIOD) + 1)
        ticks = SERVO_PERIOD * np.arange(round(self.duration / SERVO_PERIOD) + 1)
        steps = TIME_STEP * np.arange(round(self.duration / TIME_STEP) + 1)
        starts = np.array([time for _, time in self.phases])
        phase = np.array([self.phases[k][0] for k in np.searchsorted(starts, ticks + 1e-9, side="right") - 1])
        attempts = np.cumsum((phase == Phase.INTERCEPT) & (np.diff(phase, prepend=0) != 0))
        zero = np.zeros(len(cycles))

        stamps = cycles - LAG - VISION_PERIOD
        there = stamps >= 0.0
        along, across = self.offsets(stamps).T
        xy = self.place(stamps) + np.column_stack([-across, along])  # along is +y, left is -x
        point = np.column_stack([stamps, xy, zero + TRAIN_Z, zero, self.valid(stamps)]) * there[:, None]
        packets = np.array([self.packet(k, stamp) for k, stamp in enumerate(stamps)]) * there[:, None]
        filtered = np.column_stack([packets[:, [0, 5, 6, 7, 8]], zero + SPEED, there])

        due = ticks + SERVO_PERIOD
        newest = np.floor((ticks + 1e-9) / VISION_PERIOD).astype(int)
        frozen = np.isin(phase, (Phase.INTERCEPT, Phase.CLOSE, Phase.LIFT, Phase.HOLD, Phase.RETREAT))
        for k in np.nonzero(frozen)[0]:
            newest[k] = newest[k - 1]
        hand = self.predicted(due)
        known = packets[newest, 4]
        rate = np.zeros((len(ticks), 4))
        target = np.column_stack([due, hand, rate, packets[newest, :2], 0 * due, frozen * 0, known]) * known[:, None]

        verdict = np.column_stack(
            [self.verdict.get(name, lambda t: 0.0 * t)(cycles) for name in TASK.signals()["truth_verdict"][1]]
        )
        place, tool = self.place(cycles), self.predicted(cycles)
        half = 0.5 * (self.yaw + self.turned)
        lift = verdict[:, 0]
        velocity = np.column_stack([zero, zero, zero, zero, zero + SPEED, zero])  # angular, then translational
        train = np.column_stack([zero + np.cos(half), zero, zero, zero + np.sin(half), place, TRAIN_Z + lift, velocity])
        data = {
            "centroid_left": (cycles, np.zeros((len(cycles), 5))),
            "centroid_right": (cycles, np.zeros((len(cycles), 5))),
            "point": (cycles, point),
            "filtered": (cycles, filtered),
            "prediction": (cycles, packets),
            "delivered": (cycles, packets),
            "target": (ticks, target),
            "command": (ticks, np.column_stack([phase, np.zeros((len(ticks), 5)), np.full(len(ticks), 0.088)])),
            "status": (ticks, np.zeros((len(ticks), 8))),
            "diagnosis": (ticks, np.column_stack([phase, attempts, 0 * phase + self.gate, *np.zeros((3, len(ticks)))])),
            "q_commanded": (ticks, np.zeros((len(ticks), 6))),
            "arm_state": (steps, np.zeros((len(steps), 12))),
            "arm_effort": (steps, np.zeros((len(steps), 6))),
            "jaws": (cycles, np.column_stack([zero + 0.088, zero, zero])),
            "truth_train_state": (cycles, train),
            "truth_verdict": (cycles, verdict),
        }
        log = {name: Signal(times, rows, tuple(TASK.signals()[name][1])) for name, (times, rows) in data.items()}
        log["tool"] = Signal(cycles, tool, ("x", "y", "z", "yaw"))
        return log

    def predicted(self, t):
        """(x, y, z, yaw) at which the train is predicted at times t."""
        place = self.place(t)
        return np.column_stack([place[:, 0] - self.beside(t), place[:, 1], 0 * t + TRAIN_Z, 0 * t + self.yaw])

    def packet(self, seq, stamp):
        knots = np.zeros((KNOT_COUNT, 5))
        knots[:, :4] = self.predicted(stamp + KNOT_SPACING * np.arange(KNOT_COUNT))
        return pack_prediction(stamp, seq, knots)


@pytest.fixture
def scenario():
    return straight_scenario()


@pytest.fixture
def episode(scenario):
    return Episode(scenario)


@pytest.fixture
def grasp_phases():
    """The phases of one attempt that succeeds: launch shown at 3.00 s, closing at 3.30 s."""
    return [
        (Phase.ACQUIRE, 0.0),
        (Phase.TRACK, 1.02),
        (Phase.INTERCEPT, 3.00),
        (Phase.CLOSE, 3.30),
        (Phase.LIFT, 3.54),
        (Phase.HOLD, 4.56),
    ]


@pytest.fixture
def known():
    """Constants of the made-up run."""
    return SimpleNamespace(SPEED=SPEED, LAG=LAG + vision_slot(ESTIMATOR_SLOT), TRAIN_Z=TRAIN_Z, tick=tick)


@pytest.fixture
def nothing():
    """The log of a run that was over before anything was logged."""
    empty = np.zeros(0)
    log = {name: Signal(empty, np.zeros((0, len(names))), tuple(names)) for name, (_, names) in TASK.signals().items()}
    log["tool"] = Signal(np.zeros(0), np.zeros((0, 4)), ("x", "y", "z", "yaw"))
    return log
