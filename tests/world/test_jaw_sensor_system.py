import pytest

from drake_tracker.core.messages import JawState
from drake_tracker.world.base_world_diagram import JawSensorSystem


def sense(state, effort):
    system = JawSensorSystem()
    context = system.CreateDefaultContext()
    system.GetInputPort("gripper_state").FixValue(context, state)
    system.GetInputPort("drive_effort").FixValue(context, [effort])
    return JawState(system.GetOutputPort("jaws").Eval(context))


def test_the_width_is_the_way_of_both_fingers():
    jaws = sense([0.021, 0.019, -0.10, -0.12], 0.0)
    assert jaws.width == pytest.approx(0.040)
    assert jaws.speed == pytest.approx(-0.22)


@pytest.mark.parametrize("effort, force", [(-50.0, 25.0), (-10.0, 5.0), (0.0, 0.0), (30.0, 0.0)])
def test_the_closing_force_is_half_the_drives_and_opening_is_no_grip(effort, force):
    assert sense([0.02, 0.02, 0.0, 0.0], effort).force == pytest.approx(force)
