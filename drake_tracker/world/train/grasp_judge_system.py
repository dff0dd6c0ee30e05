"""The judge of the train: decides from the ground truth whether it was grasped. Nothing in the loop reads it.

If several trains may be grasped, the judge considers the train that a finger touched last; before any touch, the first
train. The train counts as grasped when it hangs at least `LIFTED` above its place on the rail, touched by both fingers,
for `HELD`. The judge also reports whether the arm touches the table or itself.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem

from drake_tracker.core.messages import Verdict, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.config import LIFTED
from drake_tracker.world.contacts import touching_pairs
from drake_tracker.world.train.plant import Laboratory
from drake_tracker.world.train.tracks import Track

HELD = 1.0
"""Time [s] for which it must be held."""
TIPPED = np.deg2rad(60.0)
"""Tilt [rad] beyond which the train does not fall back on its wheels."""
AT_REST = 0.05
"""Speed [m/s] below which the train lies; a train that is carried or still rolls does not."""
FALLEN = 0.05
"""Distance below its place on the rail [m] at which the train has fallen off the table."""
OFF_TRACK = 0.035
"""Distance [m] from its track beyond which the train does not return."""


class GraspJudgeSystem(LeafSystem):
    """Judges a run of the train from the simulator's ground truth.

    .. pydrake_system::

        name: GraspJudgeSystem
        input_ports:
        - contact_results
        - train_state
        output_ports:
        - verdict
        - judged

    ``contact_results``: the plant's port of that name. ``train_state``: the 13 numbers of the free body;
    ``train_state_1`` and following exist with ``others``. ``verdict``: a `Verdict`, updated every ``period`` at
    ``offset``; all zeros before the first update. ``judged``: number of the train that it is about, 0 for the first,
    k for the k-th of ``others``. It changes when a finger touches another train, and no longer after the verdict that a
    train was grasped.

    Args:
        laboratory: the plant with the train, the arm and the table.
        track: on which the train runs.
        rest_height: z_W of the train's reference point while it stands on the rail [m].
        others: body and track of each further train that may be grasped.
        turns: whether the heading of a train tells the branches of its track apart.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(
        self,
        *,
        laboratory: Laboratory,
        track: Track,
        rest_height: float,
        others: Sequence[tuple[RigidBody, Track]] = (),
        turns: bool = True,
        period: float = VISION_PERIOD,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        self._turns = turns
        self._tracks = (track, *(each for _, each in others))
        plant = laboratory.plant
        self._rest_height = rest_height
        self._trains = [laboratory.train_body.index(), *(body.index() for body, _ in others)]
        self._fingers = [finger.index() for finger in laboratory.fingers]
        self._table = set(plant.GetBodyIndices(laboratory.table)) | {plant.world_body().index()}
        self._arm_bodies = set(plant.GetBodyIndices(laboratory.arm)) | set(plant.GetBodyIndices(laboratory.gripper))
        self._contacts = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self._states = [
            self.DeclareVectorInputPort("train_state" if number == 0 else f"train_state_{number}", 13)
            for number in range(len(self._trains))
        ]
        self._findings = self.DeclareDiscreteState(message_size(Verdict))
        self._judged = self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("verdict", self._findings)
        self.DeclareStateOutputPort("judged", self._judged)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        verdict = Verdict(np.array(context.get_discrete_state(self._findings).value()))
        judged = int(context.get_discrete_state(self._judged).value()[0])
        touching = touching_pairs(self._contacts.Eval(context))
        touched = [
            number
            for number, train in enumerate(self._trains)
            if any(frozenset((train, finger)) in touching for finger in self._fingers)
        ]
        if touched and judged not in touched and not verdict.taken:
            judged = touched[0]
            verdict.held_since = 0.0
        verdict.lift = self._lift(context, judged)
        verdict.left_contact, verdict.right_contact = (
            float(frozenset((self._trains[judged], finger)) in touching) for finger in self._fingers
        )
        if verdict.lift >= LIFTED and verdict.left_contact and verdict.right_contact:
            verdict.held_since = verdict.held_since or context.get_time()
            verdict.held = context.get_time() - verdict.held_since
        else:
            verdict.held_since = verdict.held = 0.0
        verdict.taken = max(verdict.taken, float(verdict.held >= HELD - 1e-9))
        verdict.derailed = float(
            not (verdict.left_contact or verdict.right_contact) and self._lies_off_track(context, judged)
        )
        if any(pair & self._arm_bodies and pair & self._table for pair in touching):
            verdict.table_touched = 1.0
        if any(pair <= self._arm_bodies for pair in touching):
            verdict.self_touched = 1.0
        state.set_value(self._findings, verdict[:])
        state.set_value(self._judged, [judged])

    def _lift(self, context: Context, number: int) -> float:
        """Returns the height of a train above its place on the rail [m]; on a hill above the nearest place."""
        state, track = self._states[number].Eval(context), self._tracks[number]
        if track.heights is None:
            return state[6] - self._rest_height
        place = track.locate(state[4], state[5], 0.0, 0.0)[0]
        return state[6] - self._rest_height - float(track.profile(place)[0])

    def _lies_off_track(self, context: Context, number: int) -> bool:
        """Returns whether a train rests tipped over, or farther from its track than the rail can reach, or fell."""
        # The plant lets the quaternion's norm drift.
        qw, qx, qy, qz, x, y, _, _, _, _, vx, vy, vz = self._states[number].Eval(context)
        if self._lift(context, number) < -FALLEN:
            return True
        if vx * vx + vy * vy + vz * vz > AT_REST**2:
            return False
        spin, tilt = qw * qw + qz * qz, qx * qx + qy * qy
        upright = (spin - tilt) / (spin + tilt)
        heading = np.arctan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
        track = self._tracks[number]
        lateral = track.nearest(x, y, heading)[1] if self._turns else track.locate(x, y, 0.0, 0.0)[1]
        return upright < np.cos(TIPPED) or abs(lateral) > OFF_TRACK


def add_grasp_judge(
    builder: DiagramBuilder,
    *,
    laboratory: Laboratory,
    track: Track,
    rest_height: float,
    others: Sequence[tuple[RigidBody, Track]] = (),
    turns: bool = True,
    name: str = "judge",
) -> GraspJudgeSystem:
    """Adds a `GraspJudgeSystem` and connects it to the plant of a laboratory.

    Args:
        builder: of the diagram that has the plant.
        laboratory: as for `GraspJudgeSystem`.
        track: as for `GraspJudgeSystem`.
        rest_height: as for `GraspJudgeSystem`.
        others: as for `GraspJudgeSystem`.
        turns: as for `GraspJudgeSystem`.
        name: of the System.
    """
    plant = laboratory.plant
    judge = builder.AddNamedSystem(
        name, GraspJudgeSystem(laboratory=laboratory, track=track, rest_height=rest_height, others=others, turns=turns)
    )
    builder.Connect(plant.get_contact_results_output_port(), judge.GetInputPort("contact_results"))
    builder.Connect(plant.get_state_output_port(laboratory.train), judge.GetInputPort("train_state"))
    for number, (body, _) in enumerate(others, start=1):
        state = plant.get_state_output_port(body.model_instance())
        builder.Connect(state, judge.GetInputPort(f"train_state_{number}"))
    return judge
