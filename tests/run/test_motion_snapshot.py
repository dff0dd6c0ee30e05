"""Tests of the System that keeps intermediate images of the motion detector."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.motion_snapshot import add_motion_snapshot
from drake_tracker.tasks.filming import Snapshot
from drake_tracker.tasks.train.pictures.filming import TRAIN_SNAPSHOT
from drake_tracker.vision.centroid.normal_flow import MotionImages


class OneCamera(LeafSystem):
    """Images whose grey level is the time; the phase is FOLLOW from 1 s to 2 s, WAIT before and after."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractOutputPort("motion_images", lambda: AbstractValue.Make(object()), self._images)
        self.DeclareVectorOutputPort("command", 7, self._command)

    def _command(self, context, output):
        follows = 1.0 <= context.get_time() < 2.0
        output.SetFromVector([CatchPhase.FOLLOW if follows else CatchPhase.WAIT] + [0.0] * 6)

    def _images(self, context, output):
        output.set_value(np.full((20, 30), context.get_time()))


class Vision(LeafSystem):
    """Images whose grey level is the time, from 0.5 s on; the hand tracks from ``start`` to ``end`` [s]."""

    def __init__(self, start, end):
        super().__init__()
        self.looked_at = []
        for side in ("left", "right"):
            self.DeclareAbstractOutputPort(f"motion_images_{side}", lambda: AbstractValue.Make(object()), self._images)
        self._tracking = (start, end)
        self.DeclareVectorOutputPort("command", 7, self._command)

    def _command(self, context, output):
        start, end = self._tracking
        output.SetFromVector([Phase.TRACK if start <= context.get_time() < end else Phase.LIFT] + [0.0] * 6)

    def _images(self, context, output):
        now = context.get_time()
        self.looked_at.append(now)
        image = np.full((20, 30), now)
        output.set_value(MotionImages(*[image] * 6) if now > 0.5 else None)


def run(tmp_path, start, end):
    builder = DiagramBuilder()
    vision = builder.AddSystem(Vision(start, end))
    recorder = add_motion_snapshot(builder, hand_eye=vision, snapshot=TRAIN_SNAPSHOT, path=tmp_path / "motion.png")
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(5.5)
    context = simulator.get_context()
    recorder.finish(context)
    system = recorder._system
    return vision, system.kept(system.GetMyContextFromRoot(context))


def test_the_newest_images_while_tracking_are_kept(tmp_path):
    vision, kept = run(tmp_path, 0.0, 3.5)
    assert kept["left"].smoothed[0, 0] == 3.0
    assert set(vision.looked_at) == {0.0, 1.0, 2.0, 3.0}
    assert (tmp_path / "motion.png").stat().st_size > 1000


def test_no_picture_is_drawn_if_the_hand_never_tracks(tmp_path):
    vision, kept = run(tmp_path, 9.0, 9.0)
    assert kept is None and vision.looked_at == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("duration, expected", [(0.9, 0.8), (3.0, 1.8)])
def test_images_of_a_preferred_phase_are_not_overwritten(tmp_path, duration, expected):
    builder = DiagramBuilder()
    drawn = []
    snapshot = Snapshot(
        sides=("",),
        phases=(CatchPhase.WAIT, CatchPhase.FOLLOW),
        period=0.2,
        draw=lambda images, path: drawn.append(images[""][0, 0]),
    )
    recorder = add_motion_snapshot(builder, hand_eye=builder.AddSystem(OneCamera()), snapshot=snapshot, path=tmp_path)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    recorder.finish(simulator.get_context())
    assert drawn == pytest.approx([expected])
