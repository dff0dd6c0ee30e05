"""Tests of the train's diagram with markers on the hand: wiring, lag, and what is refused."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from wires import arrows

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.description import PUMA560, PUMA560_MARKED
from drake_tracker.arm.marker_kinematics import MarkerKinematics
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import HandCorrection, HandPoint
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.tasks.train.two_processes import resolve_split

MARKED = ["arm.markers=true", "cameras.render_processes=0"]


@pytest.mark.parametrize("tracker", ["!MotionCentroid {}", "!SilhouetteTracker {}"])
def test_the_hand_point_goes_from_vision_over_the_link_to_the_arm(tracker):
    hand_eye = make_diagram(load_scenario("train:learned", overrides=[*MARKED, f"vision.method={tracker}"]))
    wires = arrows(hand_eye)
    assert ("vision", "hand_point", "link", "hand_point") in wires
    assert ("link", "delivered_hand_point", "arm", "hand_point") in wires
    assert {("world", name, "vision", name) for name in ("arm_state", "jaws", "camera_left", "camera_right")} <= wires
    for name in ("hand_point", "delivered_hand_point", "hand_correction"):
        assert hand_eye.HasOutputPort(name)


def test_without_markers_nothing_of_it_exists():
    hand_eye = make_diagram(load_scenario("train:learned", overrides=["vision.method=!SilhouetteTracker {}"]))
    names = {hand_eye.get_output_port(k).get_name() for k in range(hand_eye.num_output_ports())}
    assert not {"hand_point", "delivered_hand_point", "hand_correction"} & names
    assert not hand_eye.arm.HasSubsystemNamed("visual_edge") and not hand_eye.vision.HasSubsystemNamed("hand_markers")


@pytest.mark.parametrize(("name", "every"), [("train:learned", 1), ("train:guided", 2)])
def test_rendered_cameras_measure_the_hand_and_the_error_of_their_calibration(name, every):
    faults = "faults=[!CalibrationWrong {camera: right, angle_deg: 1.0, distance: -0.01}]"
    cycles = [f"vision.method.update_cycles={every}"] if every > 1 else []
    scenario = load_scenario(name, overrides=[*MARKED, *cycles, faults, "vision.lag_cycles=3"])
    hand_eye = make_diagram(scenario)
    simulator = Simulator(hand_eye, hand_eye.CreateDefaultContext())
    context = simulator.get_context()
    end = 0.1 + 0.15 * every
    simulator.AdvanceTo(end)
    hand = HandPoint(hand_eye.GetOutputPort("hand_point").Eval(context))
    assert hand.valid and hand.stamp == pytest.approx(end - 3 / 60, abs=(every + 0.01) / 60)
    assert round(60 * hand.stamp) % every == 0
    correction = HandCorrection(hand_eye.GetOutputPort("hand_correction").Eval(context))
    assert correction.used and correction.rejected == 0
    n = hand_eye.arm.model.num_joints
    p_WT = hand_eye.arm.model.tool_pose(hand_eye.GetOutputPort("arm_state").Eval(context)[:n]).translation()
    error = np.array([hand.x, hand.y, hand.z]) - p_WT
    # An error of 34 mm across the right camera's view moves the point along the left camera's view.
    assert 0.02 < np.linalg.norm(error[:2]) < 0.045 and abs(error[2]) < 0.015


def test_the_mask_of_the_arm_moves_to_where_a_wrongly_calibrated_camera_sees_the_hand():
    fault = "faults=[!CalibrationWrong {camera: right, angle_deg: 1.0, distance: -0.01}]"
    true, wrong = (masks_of_the_right_camera([*MARKED, *more]) for more in ([], [fault]))
    before, after = (
        ((here & there).sum() / here.sum(), (there & ~here).sum() / here.sum()) for here, there in zip(true, wrong)
    )
    assert before[0] < 0.9 and before[1] > 0.2
    assert after[0] > 0.97 and after[1] < 0.01


def masks_of_the_right_camera(settings):
    """Where the mask of the arm is at the start and when the markers have been seen, bool of shape (h, w) each."""
    hand_eye = make_diagram(
        load_scenario("train:learned", overrides=[*settings, "vision.method=!SilhouetteTracker {}"])
    )
    simulator = Simulator(hand_eye, hand_eye.CreateDefaultContext())
    silhouette = hand_eye.vision.GetSubsystemByName("object_vision").GetSubsystemByName("arm_silhouette")
    context = silhouette.GetMyContextFromRoot(simulator.get_context())
    masks = []
    for time in (0.0, 0.25):
        simulator.AdvanceTo(time)
        masks.append(silhouette.GetOutputPort("hidden_right").Eval(context) > 0)
    return masks


def test_the_markers_are_on_the_fingers():
    kinematics = MarkerKinematics(PUMA560_MARKED)
    q = np.array(PUMA560.q_start)
    narrow, wide = (kinematics.places(q, width) for width in (0.02, 0.08))
    np.testing.assert_allclose(narrow.p_WT, wide.p_WT)
    np.testing.assert_allclose(np.linalg.norm(wide.p_WM[0] - wide.p_WM[1]), 0.08 + 2 * 0.014)
    np.testing.assert_allclose(np.linalg.norm(narrow.p_WM[0] - narrow.p_WM[1]), 0.02 + 2 * 0.014)
    np.testing.assert_allclose((wide.p_WM.mean(axis=0) - wide.p_WT) @ wide.up_W[0], 0.040, atol=1e-9)
    with pytest.raises(DrakeTrackerError, match="marker_left and marker_right"):
        MarkerKinematics(PUMA560)


def test_markers_that_nobody_could_use_are_refused():
    with pytest.raises(DrakeTrackerError, match=r"arm.markers.*must be false with vision !Measured"):
        load_scenario("train:learned", overrides=["arm.markers=true", "vision=!Measured {}"])
    with pytest.raises(DrakeTrackerError, match=r"arm.markers.*need one process"):
        resolve_split(load_scenario("train:learned", overrides=MARKED))
    with pytest.raises(DrakeTrackerError, match="the cup has no fingers"):
        arm_of(load_scenario("ball", overrides=["arm=!Puma560 {markers: true}"]))
