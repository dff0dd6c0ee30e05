"""The judge: decides from truth whether the train was taken. It sits outside the loop; nothing in the loop reads it.

The train counts as taken when it hangs at least `LIFTED` above where it ran, touched by both fingers, for `HELD`. The
judge also watches whether the arm touches the table.
"""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import Verdict
from drake_tracker.core.timing import VISION_PERIOD

LIFTED = 0.10
"""Height [m] above its place on the rail at which the train counts as lifted."""
HELD = 1.0
"""Time [s] for which it must be held."""
TIPPED = np.deg2rad(60.0)
"""Tilt [rad] from which the train does not come back on its wheels."""
OFF_TRACK = 0.035
"""Distance [m] from its track from which the train does not come back."""


class JudgeSystem(LeafSystem):
    """Judges a run from the simulator's truth, 60 times a second.

    .. pydrake_system::

        name: JudgeSystem
        input_ports:
        - contact_results
        - train_state
        output_ports:
        - verdict

    ``train_state`` is the free body's 13 numbers, ``verdict`` a `Verdict`.
    """

    def __init__(self, laboratory, track, table_height, train_height):
        super().__init__()
        self._track = track
        plant = laboratory.plant
        self._rest_height = table_height + train_height
        self._train = laboratory.train_body.index()
        self._fingers = [finger.index() for finger in laboratory.fingers]
        self._table = set(plant.GetBodyIndices(laboratory.table)) | {plant.world_body().index()}
        self._arm_bodies = set(plant.GetBodyIndices(laboratory.arm)) | set(plant.GetBodyIndices(laboratory.gripper))
        self._contacts = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self._train_state = self.DeclareVectorInputPort("train_state", 13)
        findings = self.DeclareDiscreteState(len(Verdict.get_fields()))
        self.DeclareStateOutputPort("verdict", findings)
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, 0.0, self._update)

    def _update(self, context, state):
        verdict = Verdict(np.array(context.get_discrete_state_vector().value()))
        touching = touching_pairs(self._contacts.Eval(context))
        verdict.lift = self._train_state.Eval(context)[6] - self._rest_height
        verdict.left_contact, verdict.right_contact = (
            float(frozenset((self._train, finger)) in touching) for finger in self._fingers
        )
        if verdict.lift >= LIFTED and verdict.left_contact and verdict.right_contact:
            verdict.held_since = verdict.held_since or context.get_time()
            verdict.held = context.get_time() - verdict.held_since
        else:
            verdict.held_since = verdict.held = 0.0
        verdict.taken = max(verdict.taken, float(verdict.held >= HELD - 1e-9))
        verdict.derailed = float(not (verdict.left_contact or verdict.right_contact) and self._lies_off_track(context))
        if any(pair & self._arm_bodies and pair & self._table for pair in touching):
            verdict.table_touched = 1.0
        state.set_value(verdict[:])

    def _lies_off_track(self, context):
        """Whether the train is tipped over, or stands farther from its track than the rail can reach."""
        qw, qx, qy, qz, x, y, *_ = self._train_state.Eval(context)  # the plant lets the quaternion's norm drift
        spin, tilt = qw * qw + qz * qz, qx * qx + qy * qy
        upright = (spin - tilt) / (spin + tilt)
        heading = np.arctan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
        _, lateral = self._track.nearest(x, y, heading)
        return upright < np.cos(TIPPED) or abs(lateral) > OFF_TRACK


def touching_pairs(contacts):
    """Returns the pairs of bodies that touch, frozensets of two body indices, of the plant's `ContactResults`."""
    pairs = set()
    for i in range(contacts.num_point_pair_contacts()):
        info = contacts.point_pair_contact_info(i)
        pairs.add(frozenset((info.bodyA_index(), info.bodyB_index())))
    return pairs
