"""Why parts were lost: the cause for each part that arrived and was not placed, in one sentence, from the log."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import BELT_FIELDS, PART_FIELDS, packet_target
from drake_tracker.dispatch.candidate import Candidate, FreeHand
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.part_history import PICKING, PartHistory
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.conveyor.windows import could_be_picked, window_times
from drake_tracker.tasks.episode import Log
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import cell_centres
from drake_tracker.world.conveyor.part_fates import PartFate

IDENTITY_LOST = 0.5
"""Time without an estimate from which the identity of a part counts as lost, while it is in the picking window [s]."""
FREE = (PickPhase.WAIT, PickPhase.TRACK)
"""Phases in which the hand can still go for another part."""


@dataclass(frozen=True)
class LostPart:
    """A part that arrived and was not placed.

    Attributes:
        number: of the part.
        cause: one of the causes of `lost_parts`.
        sentence: what happened, for a reader of the report.
    """

    number: int
    cause: str
    sentence: str


@dataclass(frozen=True)
class Chance:
    """The first time at which a free hand could have picked a part, as the dispatcher's model of the cycle says.

    Attributes:
        time: when [s].
        instead: number of the track for which the hand went then, 0 when it waited.
    """

    time: float
    instead: int


def lost_parts(
    setup: ConveyorSetup, histories: Sequence[PartHistory], log: Log, simulated: float
) -> tuple[LostPart, ...]:
    """Returns the parts that arrived and were not placed, in the order of arrival, with the cause for each.

    The first of these causes that holds counts:

    - "dropped": it was picked, and fell, or was put down beside a cell.
    - "lies on its side": it came so, and cannot be picked.
    - "run ended": the hand picked it, held it, or carried it to a cell when the run ended.
    - "grasp failed": the hand descended towards it.
    - "arrived too late": the whole chance to pick and place it did not lie within the run (`could_be_picked`).
    - "not seen in time": vision did not report it before it left the picking window.
    - "identity lost": while it was in the window, the host did not know it for longer than `IDENTITY_LOST`. A part that
      the arm hides for a while is still known.
    - "no space for the jaws": another part was too close to it in the whole picking window.
    - "trays full": all cells had a part when it left the picking window.
    - "ordered too late": the hand went to it and followed it, but did not descend. An order that the host changed
      while the hand still put down the part before does not count.
    - "not chosen": a free hand could have picked it, and did something else.
    - "out of reach": whenever the hand was free, it was too late to reach it within the window.

    Args:
        setup: the resolved scenario of the run.
        histories: of all parts.
        log: {name: Signal} of the run.
        simulated: time at which the run ended [s].
    """
    owner = {number: part.number for part in histories for number in part.tracks}
    reported, estimated = _times_of(log["parts"], 2, PART_FIELDS), _times_of(log["belt"], 4, BELT_FIELDS)
    free, followed, busy = chances(setup, log), _followed(log), _being_picked(log)
    motion, cells = make_belt_motion(setup.scenario.belt), len(cell_centres(setup.scenario.tray))
    filled = sorted(part.placed_at for part in histories if part.placed_at is not None)
    full_at = filled[cells - 1] if len(filled) >= cells else np.inf
    found = []
    for part in histories:
        if part.fate in (PartFate.UPSTREAM, PartFate.PLACED):
            continue
        enters, leaves = window_times(setup, part.arrival, motion)
        numbers = part.tracks
        seen = min((reported[number][0] for number in numbers), default=np.inf)
        known = np.sort(
            np.concatenate([np.empty(0), *(estimated[number] for number in numbers if number in estimated)])
        )
        longest = _longest_gap(known, max(enters, seen), leaves)
        missed_chances = [free[number] for number in numbers if number in free]
        if part.fate is PartFate.DROPPED:
            cause, words = "dropped", "it was picked and did not reach a cell"
        elif part.arrival.lies:
            tried = "the hand descended towards it in vain" if part.attempted else "the arm left it alone"
            cause, words = "lies on its side", f"it cannot be picked so, and {tried}"
        elif part.picked_at is not None:
            cause, words = (
                "run ended",
                f"it was picked at {part.picked_at:.1f} s, and not yet placed when the run ended",
            )
        elif not busy.isdisjoint(numbers):
            cause, words = "run ended", "the hand was about to pick it when the run ended"
        elif part.attempted:
            cause, words = "grasp failed", "the hand descended towards it, and the jaws did not hold it"
        elif not could_be_picked(setup, part.arrival, simulated):
            cause, words = "arrived too late", "the run ended before it could have been picked and placed"
        elif seen >= leaves:
            cause, words = "not seen in time", f"vision did not report it before it left the window at {leaves:.1f} s"
        elif longest > IDENTITY_LOST:
            cause, words = "identity lost", f"the host did not know it for {longest:.1f} s while it was in the window"
        elif not part.had_room:
            cause, words = "no space for the jaws", "another part was too close to it in the whole window"
        elif leaves >= full_at:
            cause, words = "trays full", f"all {cells} cells had a part from {full_at:.1f} s on"
        elif not followed.isdisjoint(numbers):
            cause, words = "ordered too late", "the hand followed it, and could not descend in time"
        elif missed_chances:
            chance = min(missed_chances, key=lambda each: each.time)
            instead = owner.get(chance.instead)
            did = f"part {instead} was picked instead" if instead else "the hand waited"
            cause, words = "not chosen", f"the hand could have picked it at {chance.time:.1f} s; {did}"
        else:
            cause = "out of reach"
            words = f"the hand was never free early enough, between {enters:.1f} s and {leaves:.1f} s"
        name = part.arrival.kind.name.lower()
        found.append(LostPart(part.number, cause, f"Part {part.number} ({name}), {cause}: {words}."))
    return tuple(found)


def counted(lost: Sequence[LostPart]) -> dict[str, int]:
    """Returns {cause: number of parts}, the most frequent cause first."""
    return dict(Counter(part.cause for part in lost).most_common())


def chances(setup: ConveyorSetup, log: Log) -> dict[int, Chance]:
    """Returns {number of a track: its first chance}, for parts that a free hand left on the belt.

    The hand is free while it waits, and when it sets out for a part.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
    """
    command, status, order, belt = (log[name] for name in ("command", "status", "order", "belt"))
    if not all(len(signal.times) for signal in (command, status, order, belt)):
        return {}
    model, limits = CycleModel(setup.scenario.cycle, setup.scenario.window), setup.scenario.eligibility
    rows = belt.data[:, 4:].reshape(len(belt.times), -1, len(BELT_FIELDS))
    phases = command["phase"].astype(int)
    begins = np.diff(phases, prepend=-1) != 0
    found: dict[int, Chance] = {}
    for k in np.flatnonzero((phases == PickPhase.WAIT) | ((phases == PickPhase.TRACK) & begins)):
        time = float(command.times[k])
        at = [max(int(np.searchsorted(signal.times, time, side="right")) - 1, 0) for signal in (status, order, belt)]
        hand = FreeHand(float(status["x"][at[0]]), float(status["y"][at[0]]), time)
        ordered = int(order["number"][at[1]])
        for number, kind, x, y, _, yaw, v, std, _, clear in rows[at[2]]:
            if number == 0 or int(number) in found or int(number) == ordered or clear < limits.min_clear:
                continue
            part = Candidate(int(number), int(kind), x, y, yaw, v, std, clear)
            if std <= limits.max_std and model.pick_time(hand, part, time) is not None:
                found[part.number] = Chance(time, ordered)
    return found


def _followed(log: Log) -> set[int]:
    """Returns the numbers of the tracks that the hand followed above the belt."""
    command, target = log["command"], log["target"]
    count = min(len(command.times), len(target.times))
    following = command["phase"][:count].astype(int) == PickPhase.TRACK
    return {packet_target(seq) for seq in np.unique(target["seq"][:count][following])}


def _being_picked(log: Log) -> set[int]:
    """Returns the number of the track that the hand was about to pick at the end of the log, in a set, if any."""
    command, target = log["command"], log["target"]
    count = min(len(command.times), len(target.times))
    if not count or int(command["phase"][count - 1]) not in PICKING:
        return set()
    return {packet_target(target["seq"][count - 1])}


def _times_of(signal: Signal, header: int, fields: Sequence[str]) -> dict[int, np.ndarray]:
    """Returns {number of a track: times at which a signal has it [s]}.

    Args:
        signal: its rows have a header and a number of slots with the same fields, of which the first is the number.
        header: number of elements before the first slot.
        fields: of a slot.
    """
    numbers = signal.data[:, header :: len(fields)].astype(int)
    return {int(number): signal.times[(numbers == number).any(axis=1)] for number in np.unique(numbers) if number}


def _longest_gap(known: np.ndarray, begin: float, end: float) -> float:
    """Returns the longest time between two times without any of the times ``known`` [s]."""
    if end <= begin:
        return 0.0
    within = known[(known > begin) & (known < end)]
    return float(np.diff(np.concatenate([[begin], within, [end]])).max())
