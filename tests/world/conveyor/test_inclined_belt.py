"""A belt that rises: its frame, its parts, and what vision and judge make of them."""

import math

import numpy as np
import pytest
from conveyor_world import World, arrival
from pydrake.math import RigidTransform

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.belt_frame import BeltFrame
from drake_tracker.core.messages import PART_FIELDS, message_rows
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.measured.config import MeasuredParts
from drake_tracker.measured.measured_parts_system import MeasuredPartsSystem
from drake_tracker.vision.parts.part_vision_diagram import camera_over_belt
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import BeltConfig
from drake_tracker.world.conveyor.conveyor_plant import start_pose
from drake_tracker.world.conveyor.part_fates import PartFate

BELT = BeltConfig(incline_deg=10.0, speed=0.2)
FRAME = BELT.frame
ROWS = np.array([[0.6, -0.3, 0.47, 0.4], [0.55, 0.2, 0.45, -2.0], [0.65, 0.0, 0.48, 9.5]])


def test_the_frame_is_a_rotation_about_the_line_at_which_the_belt_has_its_height():
    world = FRAME.to_world(ROWS)
    np.testing.assert_allclose(world[:, :3], RigidTransform(FRAME.X_WB).multiply(ROWS[:, :3].T).T, atol=1e-15)
    np.testing.assert_allclose(FRAME.to_belt(world), ROWS, atol=1e-12)
    np.testing.assert_allclose(FRAME.to_world([[0.6, 0.0, 0.45, 0.0]]), [[0.6, 0.0, 0.45, 0.0]], atol=1e-15)
    assert world[1, 2] - 0.45 == pytest.approx(0.2 * math.sin(math.radians(10.0)))
    directions = RigidTransform(FRAME.X_WB).rotation().matrix() @ [
        np.cos(ROWS[:, 3]),
        np.sin(ROWS[:, 3]),
        0.0 * ROWS[:, 3],
    ]
    np.testing.assert_allclose(np.exp(1j * world[:, 3]), np.exp(1j * np.arctan2(directions[1], directions[0])))
    assert (np.abs(world[:, 3] - ROWS[:, 3]) < 0.02).all()


def test_without_an_incline_nothing_is_computed():
    frame = BeltFrame(0.0, 0.45)
    assert frame.to_world(ROWS) is ROWS and frame.to_belt(ROWS) is ROWS
    np.testing.assert_array_equal(frame.X_WB, np.eye(4))


def test_a_camera_over_the_belt_sees_the_same_pixels():
    X_CW = RigidTransform([0.1, 0.2, 1.5]).GetAsMatrix4()
    camera = CameraModel(np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), np.zeros(5), X_CW, 640, 480)
    turned = camera_over_belt(camera, FRAME)
    np.testing.assert_allclose(turned.project(ROWS[:, :3]), camera.project(FRAME.to_world(ROWS)[:, :3]), atol=1e-9)


def test_parts_ride_up_without_sliding_and_are_missed_at_the_end():
    arrivals = [arrival(0.5, kind=kind, x=0.52 + 0.08 * k) for k, kind in enumerate(PART_SHAPES)]
    world = World(arrivals, p_WT=[0.40, 0.0, 0.75], belt=BELT)
    motion = make_belt_motion(BELT)
    for time in (1.0, 2.5, 4.0):
        world.simulator.AdvanceTo(time)
        places = FRAME.to_belt(np.column_stack([world.states[:, 4:7], np.zeros(len(arrivals))]))
        expected = BELT.entry + motion.distance(time) - motion.distance(0.5)
        np.testing.assert_allclose(places[:, 1], expected, atol=1e-3)
        heights = [BELT.height + 0.5 * PART_SHAPES[each.kind].height for each in arrivals]
        np.testing.assert_allclose(places[:, 2], heights, atol=1e-3)
    assert world.fates == [PartFate.ON_BELT] * len(arrivals)
    world.simulator.AdvanceTo(6.0)
    assert world.fates == [PartFate.MISSED] * len(arrivals)


def test_measured_vision_makes_its_error_in_the_plane_of_the_belt_and_reports_the_pose_in_the_world():
    part, motion = arrival(0.0, yaw=0.8), make_belt_motion(BELT)
    X_WP = RigidTransform(FRAME.X_WB) @ RigidTransform([0.0, 0.55, 0.0]) @ RigidTransform(FRAME.X_WB).inverse()
    X_WP = X_WP @ start_pose(part, BELT, motion)
    state = [*X_WP.rotation().ToQuaternion().wxyz(), *X_WP.translation(), *np.zeros(6)]
    view = np.array([[0.48, -0.45], [0.72, 0.50]])
    system = MeasuredPartsSystem(
        MeasuredParts(), [PartKind.BOX], belt_height=BELT.height, view=view, seed=1, frame=FRAME
    )
    context = system.CreateDefaultContext()
    system.GetInputPort("truth_part_states").FixValue(context, state)
    context.SetTime(1.0)
    (row,) = [row for row in message_rows(system.GetOutputPort("parts").Eval(context), PART_FIELDS) if row[0] > 0]
    np.testing.assert_allclose(row[2:5], X_WP.translation(), atol=0.005)
    assert FRAME.to_belt(row[None, 2:6])[0, 2] == pytest.approx(BELT.height + 0.5 * PART_SHAPES[PartKind.BOX].height)
