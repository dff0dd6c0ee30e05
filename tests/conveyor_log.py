"""A made-up run of the conveyor, without simulation: parts that ride, and are picked and placed at given times."""

from dataclasses import replace

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import (
    BELT_FIELDS,
    PART_FIELDS,
    TARGET_STRIDE,
    PickOrder,
    message_rows,
    message_size,
)
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP, VISION_PERIOD
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.conveyor.task import TASK
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import cell_centres
from drake_tracker.world.conveyor.part_fates import PartFate

YAW = 0.5 * np.pi
"""Direction in which parts are ordered to lie [rad]."""


class Story:
    """What happens to one part.

    Attributes:
        arrival: of the part.
        picked: time at which it is picked [s], or None.
        placed: time at which it is placed [s], or None.
        cell: number of the cell.
        offset: (x, y) by which it misses the middle of the cell [m].
        turn: angle by which it lies wrongly [rad].
        seen: whether vision and host know it.
        ordered: whether the host orders it.
        attempted: whether the hand descends towards it.
        clear: room beside it, as the host says [m].
        dropped: whether it is dropped after the pick.
        lies: whether it lies on its side.
    """

    def __init__(self, time, kind=PartKind.BOX, **changes):
        self.arrival = Arrival(time, kind, "#e8c33a", 0.60, 0.3)
        self.picked = self.placed = None
        self.cell, self.offset, self.turn = 0, (0.0, 0.0), 0.0
        self.seen = self.ordered = True
        self.attempted = self.dropped = self.lies = False
        self.clear = 1.0
        for name, value in changes.items():
            assert hasattr(self, name), name
            setattr(self, name, value)
        self.arrival = replace(self.arrival, lies=self.lies)
        self.attempted = self.attempted or self.picked is not None


class ConveyorRun:
    """Makes the scenario and the log of a run.

    Attributes:
        stories: of the parts, in the order of arrival.
        duration: length of the run [s].
    """

    def __init__(self, stories, duration=30.0, **settings):
        self.scenario = ConveyorScenario(name="made up", seed=7, duration=duration).with_settings(settings)
        self.stories, self.duration = stories, duration
        self.arrivals = tuple(story.arrival for story in stories)
        self._motion = make_belt_motion(self.scenario.belt)

    def log(self):
        times = np.arange(0.0, self.duration + 1e-9, VISION_PERIOD)
        ticks = np.arange(0.0, self.duration + 1e-9, SERVO_PERIOD)
        fates = np.column_stack([self._fates(story, times) for story in self.stories])
        data = {name: np.zeros((len(times), len(fields))) for name, (_, fields) in TASK.signals().items()}
        when = dict.fromkeys(data, times)
        for name, (period, fields) in TASK.signals().items():
            if period != VISION_PERIOD:
                when[name] = ticks if period == SERVO_PERIOD else np.arange(0.0, self.duration, TIME_STEP)
                data[name] = np.zeros((len(when[name]), len(fields)))
        self._fill_host(data, times, fates)
        self._fill_arm(data, ticks)
        self._fill_verdict(data["truth_verdict"], fates)
        signals = {name: Signal(when[name], data[name], tuple(TASK.signals()[name][1])) for name in data}
        states = np.concatenate([self._states(story, times) for story in self.stories], axis=1)
        count = range(len(self.stories))
        signals["truth_part_states"] = Signal(
            times, states, tuple(f"{field}_{k}" for k in count for field in BODY_STATE)
        )
        signals["truth_fates"] = Signal(times, fates, tuple(f"fate_{k}" for k in count))
        signals["tool"] = Signal(times, np.full((len(times), 4), 0.5), ("x", "y", "z", "yaw"))
        return signals

    def _y(self, story, time):
        belt = self.scenario.belt
        return belt.entry + self._motion.distance(time) - self._motion.distance(story.arrival.time)

    def _fates(self, story, times):
        y = np.array([self._y(story, time) for time in times])
        fate = np.where(y > self.scenario.belt.end, PartFate.MISSED, PartFate.ON_BELT)
        fate[times < story.arrival.time] = PartFate.UPSTREAM
        if story.picked is not None:
            fate[times >= story.picked] = PartFate.DROPPED if story.dropped else PartFate.HELD
            fate[np.argmax(times >= story.picked)] = PartFate.HELD
        if story.placed is not None:
            fate[times >= story.placed] = PartFate.PLACED
        return fate.astype(float)

    def _states(self, story, times):
        belt, shape = self.scenario.belt, PART_SHAPES[story.arrival.kind]
        rows = np.zeros((len(times), len(BODY_STATE)))
        rows[:, 0], rows[:, 3] = np.cos(0.5 * story.arrival.yaw), np.sin(0.5 * story.arrival.yaw)
        rows[:, 4] = story.arrival.x
        rows[:, 5] = [self._y(story, time) for time in times]
        rows[:, 6], rows[:, 11] = belt.height + 0.5 * shape.height, belt.speed
        if story.placed is not None:
            there = times >= story.placed
            yaw = YAW + story.turn
            middle = shape.middle * np.array([np.cos(yaw), np.sin(yaw)])
            rows[there, 4:6] = cell_centres(self.scenario.tray)[story.cell] + story.offset - middle
            rows[there, 0], rows[there, 3] = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
        return rows

    def _fill_host(self, data, times, fates):
        order = PickOrder.get_fields()
        data["parts"][:, 0], data["parts"][:, 1] = times, 1.0
        for row, time in enumerate(times):
            on_belt = [
                k for k in range(len(self.stories)) if fates[row, k] == PartFate.ON_BELT and self.stories[k].seen
            ]
            tracks, slots = message_rows(data["parts"][row], PART_FIELDS), message_rows(data["belt"][row], BELT_FIELDS)
            for track, slot, k in zip(tracks, slots, on_belt):
                story = self.stories[k]
                track[0] = slot[0] = k + 1
                track[2:4] = story.arrival.x, self._y(story, time)
                slot[BELT_FIELDS.index("y")], slot[BELT_FIELDS.index("clear")] = self._y(story, time), story.clear
            ordered = [k for k in on_belt if self.stories[k].ordered]
            if ordered:
                k = ordered[0]
                for name, value in (
                    ("number", k + 1),
                    ("cell", self.stories[k].cell),
                    ("place_yaw", YAW),
                    ("valid", 1),
                ):
                    data["order"][row, order.index(name)] = value

    def _fill_arm(self, data, ticks):
        for k, story in enumerate(self.stories):
            if story.attempted:
                begin = (story.picked or story.arrival.time + 2.0) - 0.5
                trying = (ticks >= begin) & (ticks < begin + 0.4)
                data["command"][trying, 0] = PickPhase.INTERCEPT
                data["target"][trying, 10] = (k + 1) * TARGET_STRIDE + 5

    def _fill_verdict(self, verdict, fates):
        names = TASK.verdict.get_fields()
        columns = {
            "coming": fates == PartFate.UPSTREAM,
            "arrived": fates != PartFate.UPSTREAM,
            "picked": np.maximum.accumulate(fates == PartFate.HELD, axis=0),
            "placed": fates == PartFate.PLACED,
            "missed": fates == PartFate.MISSED,
            "dropped": fates == PartFate.DROPPED,
        }
        for name, flags in columns.items():
            verdict[:, names.index(name)] = flags.sum(axis=1)


def nothing_logged(arrivals):
    """The log of a run that ended at once."""
    signals = {
        name: Signal(np.zeros(0), np.zeros((0, len(fields))), tuple(fields))
        for name, (_, fields) in TASK.signals().items()
    }
    for name, (_, fields) in TASK.body_signals.items():
        names = tuple(f"{field}_{k}" for k in range(len(arrivals)) for field in fields)
        signals[name] = Signal(np.zeros(0), np.zeros((0, len(names))), names)
    assert message_size(PickOrder) == len(signals["order"].names)
    return {**signals, "tool": Signal(np.zeros(0), np.zeros((0, 4)), ("x", "y", "z", "yaw"))}
