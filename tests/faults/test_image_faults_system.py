"""Faults of the images as a System: what is held, when it is let go, and that the ball's camera has it too."""

import pytest
from ball_scenario import make_scenario, true_poses
from faulty_runs import CAMERAS, make
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.faults import config
from drake_tracker.faults.fault import FaultyView
from drake_tracker.faults.image_faults_system import add_image_faults
from drake_tracker.tasks.registry import make_diagram

VIEW = FaultyView("left", CAMERAS["left"], (100, 110, 40, 30))


class Film(LeafSystem):
    """Images whose brightness is the number of the frame."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractOutputPort("image", lambda: Value(ImageRgba8U(40, 30)), self._calc, {self.time_ticket()})

    def _calc(self, context, output: AbstractValue):
        output.get_mutable_value().mutable_data[:] = round(context.get_time() / VISION_PERIOD)


def brightness(faults, frames, view=VIEW):
    """Returns {frame: brightness of its image} with faults."""
    builder = DiagramBuilder()
    film = builder.AddSystem(Film())
    port = add_image_faults(
        builder, image_port=film.get_output_port(), view=view, faults=[make(item) for item in faults], name="faults"
    )
    builder.ExportOutput(port, "image")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    found = {}
    for frame in frames:
        simulator.AdvanceTo(frame * VISION_PERIOD)
        found[frame] = float(diagram.get_output_port().Eval(simulator.get_context()).data[..., 0].mean())
    return found


def test_a_frozen_image_is_that_of_the_beginning_and_is_let_go():
    frozen = config.FrozenImage(camera="left", at=0.1, duration=0.2)  # frames 6 to 17
    assert brightness([frozen], (5, 6, 7, 12, 17, 18, 20)) == {5: 5, 6: 6, 7: 6, 12: 6, 17: 6, 18: 18, 20: 20}


def test_a_fault_that_returns_holds_a_new_image():
    faults = [config.FrozenImage(at=0.1, duration=0.1), config.FrozenImage(at=0.3, duration=0.1)]
    assert brightness(faults, (8, 14, 20, 25)) == {8: 6, 14: 14, 20: 18, 25: 25}


def test_only_the_camera_that_a_fault_names_is_changed():
    dark = [config.CameraDark(camera="right")]
    assert brightness(dark, (5,)) == {5: 5}
    assert brightness(dark, (5,), FaultyView("right", CAMERAS["right"], VIEW.window)) == {5: 0}


def test_faults_are_applied_in_their_order():
    faults = [config.FrozenImage(at=0.1), config.CameraDark(at=0.2, duration=0.1)]
    assert brightness(faults, (10, 14, 20)) == {10: 6, 14: 0, 20: 6}


def test_a_run_continues_from_a_copy_of_its_context():
    builder = DiagramBuilder()
    film = builder.AddSystem(Film())
    frozen = [make(config.FrozenImage(at=0.1))]
    port = add_image_faults(builder, image_port=film.get_output_port(), view=VIEW, faults=frozen, name="faults")
    builder.ExportOutput(port, "image")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.2)
    again = Simulator(diagram, simulator.get_context().Clone())
    again.AdvanceTo(0.4)
    assert diagram.get_output_port().Eval(again.get_context()).data[0, 0, 0] == 6


@pytest.mark.parametrize("tag, dark", [(config.CameraDark(at=0.05), True), (config.CameraDark(at=5.0), False)])
def test_the_camera_of_the_ball_has_faults_too(tag, dark):
    scenario = make_scenario(seed=3).with_settings({"faults": [tag], "camera.render_processes": "0"})
    hand_eye = make_diagram(scenario, true_poses(scenario))
    context = hand_eye.CreateDefaultContext()
    context.SetTime(0.1)
    assert bool((hand_eye.GetOutputPort("camera").Eval(context).data[..., :3] == 0).all()) is dark
