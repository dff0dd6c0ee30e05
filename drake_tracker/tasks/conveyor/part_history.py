"""The fate of each part in a run of the conveyor, according to the log."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_tracker.core.messages import BELT_FIELDS, PART_FIELDS, PART_SLOTS, packet_target
from drake_tracker.core.part_kinds import PART_SHAPES, placed_outline
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.episode import Log
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.conveyor_config import cell_centres
from drake_tracker.world.conveyor.part_fates import PartFate

PICKING = (PickPhase.INTERCEPT, PickPhase.CLOSE, PickPhase.LIFT)
"""Phases in which the hand tries to take a part."""
WRONG_TURN = np.deg2rad(10.0)
"""Error of the direction beyond which a part is misplaced [rad]."""


@dataclass(frozen=True)
class Placement:
    """How a part lies in its cell.

    Attributes:
        error: distance from the middle of the cell to the middle of the part [m].
        turn: angle between the ordered and the true direction, modulo the symmetry of the part, at least 0 [rad].
        inside: whether the outline of the part lies in the cell, up to the middle of the walls.
    """

    error: float
    turn: float
    inside: bool

    @property
    def wrong(self) -> bool:
        """Whether the part is misplaced."""
        return self.turn > WRONG_TURN or not self.inside


@dataclass(frozen=True, eq=False)
class PartHistory:
    """The fate of one part. The time of an event that did not happen is None.

    Attributes:
        number: of the part, from 1, in the order of arrival.
        tracks: numbers under which vision reported it, see `tracks_of`.
        arrival: of the part.
        times: of the samples [s], shape (n,).
        xy: its true place at these times in W [m], shape (n, 2).
        fate: at the end.
        picked_at: time at which both fingers first held it off the belt [s].
        placed_at: time from which on it lay in a cell, until the end [s].
        ordered: whether the host ever ordered it.
        attempted: whether the hand ever descended towards it.
        seen: whether vision ever reported it.
        had_room: whether there was ever room for the jaws beside it, in the picking window.
        placement: how it lies at the end; None unless it is placed.
    """

    number: int
    tracks: frozenset[int]
    arrival: Arrival
    times: np.ndarray
    xy: np.ndarray
    fate: PartFate
    picked_at: float | None
    placed_at: float | None
    ordered: bool
    attempted: bool
    seen: bool
    had_room: bool
    placement: Placement | None


def part_histories(setup: ConveyorSetup, arrivals: Sequence[Arrival], log: Log) -> tuple[PartHistory, ...]:
    """Returns the fate of each part, in the order of arrival.

    Args:
        setup: the resolved scenario of the run.
        arrivals: the parts of the run.
        log: {name: Signal} of the run.
    """
    states, fates = log["truth_part_states"], log["truth_fates"]
    if len(fates.times) == 0:
        return ()
    tracks = tracks_of(log, len(arrivals))
    ordered: dict[int, Any] = dict(zip(log["order"]["number"].astype(int).tolist(), log["order"].data))
    attempted, roomy = _attempted(log), _with_room(setup, log)
    order_fields = log["order"].names
    histories = []
    for k, arrival in enumerate(arrivals):
        numbers = tracks[k]
        fate = fates[f"fate_{k}"].astype(int)
        orders = [ordered[number] for number in numbers if number in ordered]
        newest = max(orders, key=lambda row: row[0]) if orders else None
        order = None if newest is None else dict(zip(order_fields, newest))
        placement = None
        if fate[-1] == PartFate.PLACED and order is not None:
            pose = states.view(*(f"{field}_{k}" for field in ("x", "y", "qw", "qx", "qy", "qz")))[-1]
            placement = _placement(setup, arrival, pose, int(order["cell"]), order["place_yaw"])
        histories.append(
            PartHistory(
                number=k + 1,
                tracks=frozenset(numbers),
                arrival=arrival,
                times=states.times,
                xy=states.view(f"x_{k}", f"y_{k}"),
                fate=PartFate(int(fate[-1])),
                picked_at=_first(fates.times, fate == PartFate.HELD),
                placed_at=_last_entry(fates.times, fate == PartFate.PLACED),
                ordered=bool(orders),
                attempted=not attempted.isdisjoint(numbers),
                seen=bool(numbers),
                had_room=not roomy.isdisjoint(numbers),
                placement=placement,
            )
        )
    return tuple(histories)


def tracks_of(log: Log, count: int) -> list[set[int]]:
    """Returns the numbers under which vision reported each part: none if it never did, several if it lost its identity.

    A track belongs to the part that was nearest when the track was first reported.

    Args:
        log: {name: Signal} of the run.
        count: number of parts.
    """
    parts, states = log["parts"], log["truth_part_states"]
    places = np.stack([states.view(f"x_{k}", f"y_{k}") for k in range(count)], axis=1)
    rows = parts.data[:, 2:].reshape(-1, PART_SLOTS, len(PART_FIELDS))
    numbers = rows[:, :, 0].astype(int)
    tracks: list[set[int]] = [set() for _ in range(count)]
    for number in np.unique(numbers[numbers > 0]).tolist():
        sample, slot = np.argwhere(numbers == number)[0].tolist()
        then = min(int(np.searchsorted(states.times, parts["stamp"][sample] - 1e-6)), len(places) - 1)
        distance = np.linalg.norm(places[then] - rows[sample, slot, 2:4], axis=1)
        tracks[int(distance.argmin())].add(number)
    return tracks


def _placement(setup: ConveyorSetup, arrival: Arrival, pose: np.ndarray, cell: int, place_yaw: float) -> Placement:
    """Returns how a part lies.

    Args:
        setup: the resolved scenario of the run.
        arrival: of the part.
        pose: x, y [m] and quaternion w, x, y, z of its frame P in W, shape (6,).
        cell: number of the cell that was ordered.
        place_yaw: direction that was ordered [rad].
    """
    shape, tray = PART_SHAPES[arrival.kind], setup.scenario.tray
    x, y, qw, qx, qy, qz = pose
    yaw = np.arctan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
    centre = cell_centres(tray)[cell]
    middle = np.array([x + shape.middle * np.cos(yaw), y + shape.middle * np.sin(yaw)])
    turn = 0.0
    if shape.turns:
        period = 2.0 * np.pi / shape.turns
        turn = abs((yaw - place_yaw + 0.5 * period) % period - 0.5 * period)
    outline = placed_outline(arrival.kind, x, y, yaw)
    inside = bool((np.abs(outline - centre) <= 0.5 * tray.pitch).all())
    return Placement(float(np.hypot(*(middle - centre))), float(turn), inside)


def _attempted(log: Log) -> set[int]:
    """Returns the numbers of the parts towards which the hand ever descended."""
    command, target = log["command"], log["target"]
    count = min(len(command.times), len(target.times))
    trying = np.isin(command["phase"][:count].astype(int), PICKING)
    return {packet_target(seq) for seq in np.unique(target["seq"][:count][trying])}


def _with_room(setup: ConveyorSetup, log: Log) -> set[int]:
    """Returns the numbers of the parts that ever had room for the jaws in the picking window, as the host saw it."""
    rows = log["belt"].data[:, 4:].reshape(-1, len(BELT_FIELDS))
    number, y, clear = (rows[:, BELT_FIELDS.index(name)] for name in ("number", "y", "clear"))
    inside = (number > 0) & (y >= setup.scenario.window.y_first) & (y <= setup.scenario.window.y_last)
    return set(np.unique(number[inside & (clear >= setup.scenario.eligibility.min_clear)]).astype(int))


def _first(times: np.ndarray, flags: np.ndarray) -> float | None:
    return float(times[np.argmax(flags)]) if flags.any() else None


def _last_entry(times: np.ndarray, flags: np.ndarray) -> float | None:
    """Returns the time from which on the flags are set until the end, None when the last one is not."""
    if not flags[-1]:
        return None
    others = np.flatnonzero(~flags)
    return float(times[others[-1] + 1 if len(others) else 0])
