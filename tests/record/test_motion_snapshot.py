"""Tests of the keeper of intermediate images."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.grasp.schema import Phase
from drake_tracker.record.motion_snapshot import add_motion_snapshot
from drake_tracker.vision.normal_flow import MotionImages


class Vision(LeafSystem):
    """Makes images whose grey level is the time, from 0.5 s on; the hand tracks from ``start`` to ``end`` [s]."""

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
    recorder = add_motion_snapshot(builder, vision, tmp_path / "motion.png")
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(5.5)
    context = simulator.get_context()
    recorder.finish(context)
    system = recorder._system
    return vision, system.kept(system.GetMyContextFromRoot(context))


def test_the_newest_tracking_instant_is_kept(tmp_path):
    vision, kept = run(tmp_path, 0.0, 3.5)
    assert kept["left"].smoothed[0, 0] == 3.0
    assert set(vision.looked_at) == {0.0, 1.0, 2.0, 3.0}
    assert (tmp_path / "motion.png").stat().st_size > 1000


def test_a_hand_that_never_tracks_leaves_nothing(tmp_path):
    vision, kept = run(tmp_path, 9.0, 9.0)
    assert kept is None and vision.looked_at == []
    assert list(tmp_path.iterdir()) == []
