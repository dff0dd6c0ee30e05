"""The judge of the ball: decides from the ground truth whether it was caught. Nothing in the loop reads it.

The ball counts as caught when for `HELD` its centre has been inside the bowl while it touches the hand and not the
board. Contact and position between the bowl's walls decide, never proximity.
"""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem

from drake_tracker.core.messages import CatchVerdict, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.ball.ball_plant import BallLaboratory
from drake_tracker.world.contacts import touching_pairs

BOWL_LOWER, BOWL_UPPER = (-0.040, -0.050, 0.0), (0.040, 0.050, 0.070)
"""Inside of the bowl in the frame `tool` [m], from the rim to the bottom (model cup)."""
HELD = 1.0
"""Time [s] for which it must be held."""
RELEASED = 0.001
"""Distance [m] from its start beyond which the ball counts as released."""
JAMMED = 5.0
"""Time [s] after which a ball at rest on the board counts as jammed."""
AT_REST = 0.002
"""Speed [m/s] below which a released ball is at rest."""


class CatchJudgeSystem(LeafSystem):
    """Judges a run of the ball from the simulator's ground truth.

    .. pydrake_system::

        name: CatchJudgeSystem
        input_ports:
        - contact_results
        - body_poses
        - ball_state
        output_ports:
        - verdict

    ``contact_results`` and ``body_poses``: the plant's ports of these names. ``ball_state``: the 13 numbers of the free
    body. ``verdict``: a `CatchVerdict`, updated every ``period`` at ``offset``; all zeros before the first update. Its
    frame B moves with a board that is knocked.

    Args:
        laboratory: the plant with the ball, the board and the arm.
        tool_frame: name of the frame in the bowl's opening.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(
        self,
        *,
        laboratory: BallLaboratory,
        tool_frame: str = "tool",
        period: float = VISION_PERIOD,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        plant = laboratory.plant
        tool = plant.GetFrameByName(tool_frame, laboratory.gripper)
        self._period = period
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
        findings = self.DeclareDiscreteState(message_size(CatchVerdict))
        self.DeclareStateOutputPort("verdict", findings)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
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
            verdict.crossing_time = time - (1.0 - part) * self._period
        if not verdict.left_board and verdict.crossing_time and self._board not in touched:
            verdict.left_board = time

        still = np.linalg.norm(ball_state[10:13]) < AT_REST and self._board in touched and not touched & self._gate
        verdict.rest_since = (verdict.rest_since or time) if verdict.released and still else 0.0
        jammed = verdict.rest_since > 0.0 and time - verdict.rest_since >= JAMMED - 1e-9
        verdict.lost = max(verdict.lost, float(jammed or bool(touched & self._ground)))
        if any(pair & self._arm_bodies and pair & self._fixtures for pair in touching):
            verdict.board_touched = 1.0
        if any(pair <= self._arm_bodies for pair in touching):
            verdict.self_touched = 1.0
        state.set_value(verdict[:])


def add_catch_judge(
    builder: DiagramBuilder, *, laboratory: BallLaboratory, tool_frame: str = "tool", name: str = "judge"
) -> CatchJudgeSystem:
    """Adds a `CatchJudgeSystem` and connects it to the plant of a laboratory.

    Args:
        builder: of the diagram that has the plant.
        laboratory: as for `CatchJudgeSystem`.
        tool_frame: as for `CatchJudgeSystem`.
        name: of the System.
    """
    plant = laboratory.plant
    judge = builder.AddNamedSystem(name, CatchJudgeSystem(laboratory=laboratory, tool_frame=tool_frame))
    builder.Connect(plant.get_contact_results_output_port(), judge.GetInputPort("contact_results"))
    builder.Connect(plant.get_body_poses_output_port(), judge.GetInputPort("body_poses"))
    builder.Connect(plant.get_state_output_port(laboratory.ball), judge.GetInputPort("ball_state"))
    return judge
