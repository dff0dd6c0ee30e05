"""The judge of the conveyor: decides from the ground truth on the fate of each part. Nothing in the loop reads it.

The rules are in `world.part_fates`. The judge also reports whether the arm touches the belt, a tray, the table or
itself.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem, OutputPort

from drake_tracker.core.messages import PickVerdict, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.contacts import touching_pairs
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.conveyor_config import BeltConfig, TrayConfig
from drake_tracker.world.conveyor.conveyor_plant import ConveyorLaboratory
from drake_tracker.world.conveyor.part_fates import AT_REST, PartFate, PartView, held_parts, next_fate
from drake_tracker.world.conveyor.part_model import rest_height
from drake_tracker.world.objects_system import STATE_SIZE


class PickJudgeSystem(LeafSystem):
    """Judges a run of the conveyor from the simulator's ground truth.

    .. pydrake_system::

        name: PickJudgeSystem
        input_ports:
        - contact_results
        - part_states
        output_ports:
        - verdict
        - fates

    ``contact_results``: the plant's port of that name. ``part_states``: the 13 numbers of each part's free body.
    ``verdict``: a `PickVerdict`. ``fates``: one `PartFate` for each part, as a number. Both are updated every
    ``period`` at ``offset``, and all zeros before the first update.

    Args:
        laboratory: the plant with the parts, the arm, the belt, the trays and the table.
        arrivals: the parts, in the same order.
        belt: where the belt lies.
        tray: where the trays lie.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(
        self,
        *,
        laboratory: ConveyorLaboratory,
        arrivals: Sequence[Arrival],
        belt: BeltConfig,
        tray: TrayConfig,
        period: float = VISION_PERIOD,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        plant = laboratory.plant
        self._belt, self._tray, self._period = belt, tray, period
        self._places = [belt.height + rest_height(arrival.kind) for arrival in arrivals]
        self._parts = [body.index() for body in laboratory.parts]
        self._fingers = [finger.index() for finger in laboratory.fingers]
        self._belt_body = laboratory.belt_body.index()
        self._arm = set(plant.GetBodyIndices(laboratory.arm)) | set(plant.GetBodyIndices(laboratory.gripper))
        self._obstacles = {
            "belt_touched": {self._belt_body},
            "tray_touched": set(plant.GetBodyIndices(laboratory.trays)),
            "table_touched": set(plant.GetBodyIndices(laboratory.table)) | {plant.world_body().index()},
        }
        count = len(self._parts)
        self._contacts = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self._states = self.DeclareVectorInputPort("part_states", STATE_SIZE * count)
        self._findings = self.DeclareDiscreteState(message_size(PickVerdict))
        self._fates = self.DeclareDiscreteState(count)
        self._rested = self.DeclareDiscreteState(count)
        self._picked = self.DeclareDiscreteState(count)
        self._held = self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("verdict", self._findings)
        self.DeclareStateOutputPort("fates", self._fates)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        def value(index: int) -> np.ndarray:
            return np.array(context.get_discrete_state(index).value())

        verdict = PickVerdict(value(self._findings))
        fates, rested, picked = value(self._fates), value(self._rested), value(self._picked)
        touching = touching_pairs(self._contacts.Eval(context))
        states = self._states.Eval(context).reshape(-1, STATE_SIZE)
        speeds = np.linalg.norm(states[:, 10:13], axis=1)
        rested = np.where(speeds <= AT_REST, rested + self._period, 0.0)
        views = self._views(states, speeds, fates, touching)
        held = [list(views)[index] for index in held_parts(list(views.values()))]
        for k, view in views.items():
            fate = PartFate(int(fates[k]))
            fates[k] = next_fate(fate, view, held=k in held, rested=rested[k], belt=self._belt, tray=self._tray)
            picked[k] = max(picked[k], float(fates[k] == PartFate.HELD))
        verdict.doubles += max(len(held) - max(value(self._held)[0], 1.0), 0.0)
        verdict.held = held[0] + 1 if held else 0
        verdict.coming = np.sum(fates == PartFate.UPSTREAM)
        verdict.arrived = len(fates) - verdict.coming
        verdict.picked = picked.sum()
        verdict.placed, verdict.missed, verdict.dropped = (
            np.sum(fates == fate) for fate in (PartFate.PLACED, PartFate.MISSED, PartFate.DROPPED)
        )
        for name, bodies in self._obstacles.items():
            if any(pair & self._arm and pair & bodies for pair in touching):
                setattr(verdict, name, 1.0)
        if any(pair <= self._arm for pair in touching):
            verdict.self_touched = 1.0
        state.set_value(self._findings, verdict[:])
        state.set_value(self._fates, fates)
        state.set_value(self._rested, rested)
        state.set_value(self._picked, picked)
        state.set_value(self._held, [len(held)])

    def _views(
        self, states: np.ndarray, speeds: np.ndarray, fates: np.ndarray, touching: set[frozenset[BodyIndex]]
    ) -> dict[int, PartView]:
        """Returns {index of a part: the judge's view of it} for parts whose fate may change.

        The fate of a part that has not arrived cannot change, unless a finger touches the part.

        Args:
            states: of the parts, shape (n, 13).
            speeds: of the parts, shape (n,) [m/s].
            fates: of the parts until now, shape (n,).
            touching: the pairs of bodies that touch each other.
        """
        # The plant lets the quaternion's norm drift.
        square = states[:, :4] ** 2
        upright = (square[:, 0] + square[:, 3] - square[:, 1] - square[:, 2]) / square.sum(axis=1)
        tilt = np.arccos(np.clip(upright, -1.0, 1.0))
        # On an inclined belt a part has arrived, and rises above its place, along the belt and its normal.
        along = self._belt.frame.to_belt(np.column_stack([states[:, 4:7], np.zeros(len(states))]))
        over_belt = np.abs(states[:, 4] - self._belt.middle) <= 0.5 * self._belt.width
        waiting = (fates == PartFate.UPSTREAM) & (along[:, 1] < self._belt.entry)
        on_belt, *by_fingers = (
            {body for pair in touching if each in pair for body in pair} for each in (self._belt_body, *self._fingers)
        )
        views = {}
        for k, part in enumerate(self._parts):
            fingers = frozenset(number for number, bodies in enumerate(by_fingers) if part in bodies)
            if waiting[k] and not fingers:
                continue
            x, y, z = (along[k, :3] if over_belt[k] else states[k, 4:7]).tolist()
            views[k] = PartView(
                x=x,
                y=y,
                rise=z - self._places[k],
                tilt=float(tilt[k]),
                speed=float(speeds[k]),
                fingers=fingers,
                on_belt=part in on_belt,
            )
        return views


def add_pick_judge(
    builder: DiagramBuilder,
    *,
    laboratory: ConveyorLaboratory,
    part_states: OutputPort,
    arrivals: Sequence[Arrival],
    belt: BeltConfig,
    tray: TrayConfig,
    name: str = "judge",
) -> PickJudgeSystem:
    """Adds a `PickJudgeSystem` and connects it to the plant of a laboratory.

    Args:
        builder: of the diagram that has the plant.
        laboratory: as for `PickJudgeSystem`.
        part_states: the 13 numbers of each part.
        arrivals: as for `PickJudgeSystem`.
        belt: as for `PickJudgeSystem`.
        tray: as for `PickJudgeSystem`.
        name: of the System.
    """
    judge = builder.AddNamedSystem(
        name, PickJudgeSystem(laboratory=laboratory, arrivals=arrivals, belt=belt, tray=tray)
    )
    builder.Connect(laboratory.plant.get_contact_results_output_port(), judge.GetInputPort("contact_results"))
    builder.Connect(part_states, judge.GetInputPort("part_states"))
    return judge
