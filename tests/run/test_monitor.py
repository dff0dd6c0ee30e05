"""Tests of when a run ends."""

from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import ArmCommand, Verdict, message_size
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.monitor import AFTERGLOW, RunMonitor
from drake_tracker.tasks import task_named


class Ports(LeafSystem):
    """A diagram of which only two outputs are read."""

    def __init__(self):
        super().__init__()
        self.world, self.phase, self.derailed = None, Phase.TRACK, 0.0

    def GetMyContextFromRoot(self, context):
        return context

    def GetOutputPort(self, name):
        message = {"command": ArmCommand, "truth_verdict": Verdict}[name]
        values = message(np.zeros(message_size(message)))
        if name == "command":
            values.phase = self.phase
        else:
            values.derailed = self.derailed
        return SimpleNamespace(Eval=lambda context: values[:])


@pytest.mark.parametrize("phase", [Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE])
def test_a_run_does_not_end_with_the_hand_beside_a_train_that_was_thrown_off(phase):
    ports = Ports()
    monitor = RunMonitor(task_named("train"), ports, None, stop_when_over=True)

    def ends(time):
        return monitor(SimpleNamespace(get_time=lambda: time)).severity().name == "kReachedTermination"

    assert not ends(1.0)
    ports.phase, ports.derailed = phase, 1.0
    assert not ends(2.0)
    assert ends(2.1 + AFTERGLOW) == (phase == Phase.TRACK)
    ports.phase = Phase.RETREAT
    assert ends(2.2 + AFTERGLOW)
