"""Tests of the System that keeps the images around the last closing of the hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.constants import SIDES
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.closeup import EVERY, CloseupRecorder, add_closeup
from drake_tracker.tasks.filming import Closeup

BEFORE, AFTER = 0.4, 0.2
CLOSES_FOR = 0.15


class Laboratory(LeafSystem):
    """Images whose grey level is the number of their cycle; the hand closes for `CLOSES_FOR` s from given times on."""

    def __init__(self, closings, latency):
        super().__init__()
        self._closings, self._latency, self.evaluated = closings, latency, []
        for side in SIDES:
            blank = ImageRgba8U(8, 6)
            self.DeclareAbstractOutputPort(f"camera_{side}", lambda blank=blank: AbstractValue.Make(blank), self._image)
        self.DeclareVectorOutputPort("command", 7, self._command)

    def _image(self, context, output):
        cycle = round(context.get_time() / VISION_PERIOD)
        self.evaluated.append(cycle)
        output.get_mutable_value().mutable_data[:] = max(cycle - self._latency, 0)

    def _command(self, context, output):
        closes = any(start <= context.get_time() < start + CLOSES_FOR for start in self._closings)
        output.SetFromVector([Phase.CLOSE if closes else Phase.TRACK] + [0.0] * 6)


def closeup(latency, draw=None):
    return Closeup("grasp.png", SIDES, Phase.CLOSE, BEFORE, AFTER, latency, draw)


def run(tmp_path, duration, closings, latency=0):
    builder = DiagramBuilder()
    laboratory = builder.AddSystem(Laboratory(closings, latency))
    recorder = add_closeup(
        builder, hand_eye=laboratory, loggers={}, task=None, closeup=closeup(latency), folder=tmp_path
    )
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    frames = recorder._system.frames(simulator.get_context())
    return frames, laboratory


@pytest.mark.parametrize("latency", [0, 3, 8])
@pytest.mark.parametrize(
    "duration, closings, last", [(4.0, [1.0], 1.0), (4.0, [1.0, 2.5], 2.5), (2.6, [1.0, 2.5], 2.5), (1.1, [1.0], 1.0)]
)
def test_the_frames_around_the_last_closing_are_kept(tmp_path, duration, closings, last, latency):
    """Also where the run ends while the hand closes, and whenever images appear."""
    frames, _ = run(tmp_path, duration, closings, latency)
    times = [frame.time for frame in frames]
    assert np.diff(times) == pytest.approx(EVERY * VISION_PERIOD)
    assert times[0] <= last - BEFORE + EVERY * VISION_PERIOD
    assert times[-1] == pytest.approx(min(last + AFTER, duration), abs=1.01 * EVERY * VISION_PERIOD)
    for frame in frames:
        assert set(frame.images) == set(SIDES)
        for image in frame.images.values():
            assert image.shape == (6, 8, 3) and (image == round(frame.time / VISION_PERIOD)).all()


def test_only_the_images_of_a_short_time_are_remembered(tmp_path):
    frames, _ = run(tmp_path, 4.0, [3.0])
    assert len(frames) <= (BEFORE + AFTER) / (EVERY * VISION_PERIOD) + 2


def test_a_camera_is_read_only_in_the_cycles_of_the_vision(tmp_path):
    _, laboratory = run(tmp_path, 1.0, [0.5])
    assert set(laboratory.evaluated) <= set(range(0, 61, EVERY))


def test_a_run_in_which_the_hand_never_closed_leaves_no_picture(tmp_path):
    frames, laboratory = run(tmp_path, 1.0, [])
    assert frames == ()
    system = SimpleNamespace(frames=lambda context: frames)
    drawn = []
    CloseupRecorder(system, {}, None, laboratory, closeup(0, lambda *found: drawn.append(found)), tmp_path).finish(None)
    assert drawn == [] and list(tmp_path.iterdir()) == []
