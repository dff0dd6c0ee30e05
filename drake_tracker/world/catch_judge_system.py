"""The judge of the ball: decides from truth whether it was caught. Outside the loop; nothing in the loop reads it.

The ball counts as caught when its centre has been inside the bowl for `HELD`, in touch with the hand and with no board:
contact and place between the bowl's walls, never closeness.
"""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import CatchVerdict
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.judge_system import touching_pairs

BOWL_LOWER, BOWL_UPPER = (-0.040, -0.050, 0.0), (0.040, 0.050, 0.070)
"""Inside of the bowl in the frame `tool` [m], from the rim to the bottom (model cup)."""
HELD = 1.0
"""Time [s] for which it must be held."""
RELEASED = 0.001
"""Distance [m] from its start from which the ball counts as released."""
JAMMED = 5.0
"""Time [s] after which a ball at rest on the board counts as jammed."""
AT_REST = 0.002
"""Speed [m/s] below which a released ball is at rest."""


class CatchJudgeSystem(LeafSystem):
    """Judges a run from the simulator's truth, 60 times a second.

    .. pydrake_system::

        name: CatchJudgeSystem
        input_ports:
        - contact_results
        - body_poses
        - ball_state
        output_ports:
        - verdict

    ``body_poses`` is the plant's port of that name, ``ball_state`` the free body's 13 numbers, ``verdict`` a
    `CatchVerdict`. B moves with a board that is knocked.

    Args:
      laboratory: a `BallLaboratory`. tool_frame: name of the frame in the bowl's opening.
    """

    def __init__(self, laboratory, tool_frame="tool"):
        super().__init__()
        plant = laboratory.plant
        tool = plant.GetFrameByName(tool_frame, laboratory.gripper)
        self._X_HT = tool.GetFixedPoseInBodyFrame()
        self._hand = tool.body().index()
        self._ball = laboratory.ball_body.index()
        self._board = laboratory.board_body.index()
        self._p_BoBall = laboratory.p_BoBall
        self._gate = set(plant.GetBodyIndices(laboratory.gate))
        self._ground = set(plant.GetBodyIndices(laboratory.table)) | {plant.world_body().index()}
        self._fixtures = self._ground | self._gate | {self._board}
        self._arm_bodies = set(plant.GetBodyIndices(laboratory.arm)) | set(plant.GetBodyIndices(laboratory.gripper))
        self._contacts = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self._poses = self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform()]))
        self._ball_state = self.DeclareVectorInputPort("ball_state", 13)
        findings = self.DeclareDiscreteState(len(CatchVerdict.get_fields()))
        self.DeclareStateOutputPort("verdict", findings)
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, 0.0, self._update)

    def _update(self, context, state):
        time = context.get_time()
        before = CatchVerdict(context.get_discrete_state_vector().value())
        verdict = CatchVerdict(np.array(before[:]))
        touching = touching_pairs(self._contacts.Eval(context))
        touched = {index for pair in touching if self._ball in pair for index in pair - {self._ball}}
        poses = self._poses.Eval(context)
        ball_state = self._ball_state.Eval(context)
        p_WBall = ball_state[4:7]
        p_BBall = poses[self._board].inverse() @ p_WBall
        p_TBall = (poses[self._hand] @ self._X_HT).inverse() @ p_WBall

        verdict.height = p_WBall[2]
        verdict.x, verdict.y = p_BBall[:2]
        inside = np.all(p_TBall >= BOWL_LOWER) and np.all(p_TBall <= BOWL_UPPER)
        verdict.in_cup = float(inside and self._hand in touched)
        if verdict.in_cup and self._board not in touched:
            verdict.held_since = verdict.held_since or time
            verdict.held = time - verdict.held_since
        else:
            verdict.held_since = verdict.held = 0.0
        verdict.caught = max(verdict.caught, float(verdict.held >= HELD - 1e-9))

        if not verdict.released and np.linalg.norm(p_BBall - self._p_BoBall) > RELEASED:
            verdict.released = time
        if not verdict.crossing_time and before.y > 0.0 >= verdict.y:
            part = before.y / (before.y - verdict.y)
            verdict.crossing_x = before.x + part * (verdict.x - before.x)
            verdict.crossing_time = time - (1.0 - part) * VISION_PERIOD
        if not verdict.left_board and verdict.crossing_time and self._board not in touched:
            verdict.left_board = time

        still = np.linalg.norm(ball_state[10:13]) < AT_REST and self._board in touched and not touched & self._gate
        verdict.rest_since = (verdict.rest_since or time) if verdict.released and still else 0.0
        jammed = verdict.rest_since > 0.0 and time - verdict.rest_since >= JAMMED - 1e-9
        verdict.lost = max(verdict.lost, float(jammed or bool(touched & self._ground)))
        if any(pair & self._arm_bodies and pair & self._fixtures for pair in touching):
            verdict.board_touched = 1.0
        state.set_value(verdict[:])
