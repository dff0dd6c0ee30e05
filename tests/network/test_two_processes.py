"""Arm's side and host's side in one process, on a bus within it, in lockstep: as the diagram that has them both."""

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator

from drake_tracker import load_scenario, make_diagram
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Prediction, TrackPoints
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD
from drake_tracker.run.host_process import HostProcess
from drake_tracker.tasks.train.two_processes import make_arm_side

AFTER_THE_HOST = 6 / 16 * TIME_STEP
"""Later than what the host reads was sent, and earlier than the link reads what it answers."""
COMPARED = ("point", "delivered", "target", "command", "q_commanded", "arm_state", "truth_train_state")


@pytest.mark.parametrize("method, objects", [("!OneObject {}", "[]"), ("!SeveralObjects {}", "[!Train {}]")])
def test_with_the_same_points_everything_is_bit_for_bit_as_in_one_process(method, objects):
    overrides = [f"vision=!Measured {{method: {method}}}", "track.speed=0.2", f"objects={objects}"]
    scenario = load_scenario("train:learned", seed=3, overrides=overrides)
    lcm = DrakeLcm("memq://")
    host = HostProcess(scenario, lcm, lcm, tell=str)
    apart, together = Simulator(make_arm_side(scenario, lcm)), Simulator(make_diagram(scenario))
    packets = 0
    for cycle in range(70):
        for simulator in (apart, together):
            simulator.AdvanceTo(cycle * VISION_PERIOD + AFTER_THE_HOST)
        host.step(timeout=0.0)
        for port in COMPARED:
            values = [each.get_system().GetOutputPort(port).Eval(each.get_context()) for each in (apart, together)]
            np.testing.assert_array_equal(*values, err_msg=f"{port} in cycle {cycle}")
        packets += Prediction(apart.get_system().GetOutputPort("delivered").Eval(apart.get_context())).valid
    assert packets > 20 and host.counts["packets"] == packets + 1  # the last one is on its way


def test_images_over_the_bus_give_the_same_points():
    """Two rendered cameras, for as long as it takes until a first point; its stamp went over the bus in whole
    microseconds."""
    scenario = load_scenario("train:learned", seed=3, overrides=["vision.lag_cycles=3"])
    lcm = DrakeLcm("memq://")
    host = HostProcess(scenario, lcm, lcm, tell=str)
    apart, together = Simulator(make_arm_side(scenario, lcm)), Simulator(make_diagram(scenario))
    for cycle in range(12):
        for simulator in (apart, together):
            simulator.AdvanceTo(cycle * VISION_PERIOD + AFTER_THE_HOST)
        host.step(timeout=0.0)
    apart.AdvanceTo(12 * VISION_PERIOD)
    for port in ("centroid_left", "centroid_right", "point"):
        values = [each.get_system().GetOutputPort(port).Eval(each.get_context()) for each in (apart, together)]
        assert values[1][-1] == 1.0
        np.testing.assert_allclose(*values, rtol=0.0, atol=2e-6, err_msg=port)
    assert host.counts["cycles"] == 12 and host.counts["cycles_incomplete"] == 0


SEVERAL = ["vision.method=!SilhouetteTracker {confirm_after: 3}", "objects=[!Train {}]", "vision.lag_cycles=2"]


def test_images_over_the_bus_give_the_same_tracks():
    """The host masks the arm in the images, as the arm's state tells, and expects what it does not see."""
    scenario = load_scenario("train:learned", seed=3, overrides=SEVERAL)
    lcm = DrakeLcm("memq://")
    host = HostProcess(scenario, lcm, lcm, tell=str)
    assert set(host._side.heard) == {"camera_left", "camera_right", "arm_state", "jaws"}
    apart, together = Simulator(make_arm_side(scenario, lcm)), Simulator(make_diagram(scenario))
    cycles = 24
    for cycle in range(cycles):
        for simulator in (apart, together):
            simulator.AdvanceTo(cycle * VISION_PERIOD + AFTER_THE_HOST)
        host.step(timeout=0.0)
    apart.AdvanceTo(cycles * VISION_PERIOD)
    for port in ("tracks", "regions_left", "regions_right", "point", "centroid_left"):
        values = [each.get_system().GetOutputPort(port).Eval(each.get_context()) for each in (apart, together)]
        np.testing.assert_allclose(*values, rtol=0.0, atol=1e-4, err_msg=port)
    assert TrackPoints(values_of(together, "tracks")).target > 0.0
    assert host.counts["cycles"] == cycles and host.counts["cycles_incomplete"] == 0


def values_of(simulator, port):
    return np.array(simulator.get_system().GetOutputPort(port).Eval(simulator.get_context()))


def test_images_without_the_state_of_the_arm_are_not_used():
    scenario = load_scenario("train:learned", seed=3, overrides=SEVERAL)
    lcm = DrakeLcm("memq://")
    host = HostProcess(scenario, lcm, lcm, tell=str)
    used = []
    say = host._say_frames

    def noted(messages, number):
        say(messages, number)
        used.append(host._side.GetInputPort("frame_left").Eval(host._simulator.get_context())[1])

    host._say_frames = noted
    arm = Simulator(make_arm_side(scenario, lcm))
    for cycle in range(6):
        arm.AdvanceTo(cycle * VISION_PERIOD + AFTER_THE_HOST)
        for port, data in host.mailbox.collect(0.0):
            if cycle != 3 or port != "arm_state":
                for found in host._take(port, data):
                    host._work(found)
    assert used[0] == 0.0 and used[1:] == [1.0, 1.0, 1.0, 0.0, 1.0, 1.0]
    assert host.counts["cycles_incomplete"] == 1


@pytest.mark.parametrize("side", ["arm", "host"])
def test_a_ball_is_refused(side):
    scenario, lcm = load_scenario("ball"), DrakeLcm("memq://")
    with pytest.raises(DrakeTrackerError, match="ball: .*only the train runs in two processes"):
        make_arm_side(scenario, lcm) if side == "arm" else HostProcess(scenario, lcm, lcm)
