from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.arm.arm_shape import TOLERANCE, ArmShape
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E
from drake_tracker.core.errors import DrakeTrackerError

HAND = """<sdf version="1.9"><model name="gripper"><link name="hand">
<visual name="look"><pose>0.1 0 0 0 0 0</pose><geometry>{}</geometry></visual></link>
<frame name="tool" attached_to="hand"/></model></sdf>"""
AXES = np.vstack([np.eye(3), -np.eye(3)])


def with_hand(tmp_path, geometry):
    """A PUMA 560 whose hand is one visual geometry, 0.1 m beside the hand's frame."""
    path = tmp_path / "hand.sdf"
    path.write_text(HAND.format(geometry))
    return replace(PUMA560_CUP, gripper_url=path.as_uri())


def reach(points, direction):
    return float((points @ direction).max())


@pytest.mark.parametrize(
    "description", [PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E], ids=["puma560", "cup", "seven_joint", "ur5e"]
)
def test_every_moving_link_has_a_piece_of_few_points_and_the_base_has_none(description):
    q = np.array(description.q_start)
    links = len(q) + 1 + len(description.fingers)
    pieces = ArmShape(description).pieces(q)
    assert len(pieces) == links
    assert max(map(len, pieces)) < 200
    moved = ArmShape(description).pieces(q + 0.1)
    assert all(np.abs(a - b).max() > 1e-3 for a, b in zip(pieces, moved, strict=True))


def test_the_hand_lies_about_the_tool(arm_model):
    q = np.array(PUMA560.q_start)
    X_WT = arm_model.tool_pose(q)
    left, right = (X_WT.inverse() @ piece.T for piece in ArmShape(PUMA560).pieces(q, 0.06)[-2:])
    assert left[1].min() == pytest.approx(0.03, abs=TOLERANCE)
    assert right[1].max() == pytest.approx(-0.03, abs=TOLERANCE)
    assert left[2].max() == pytest.approx(0.013, abs=0.003)


def test_nothing_is_kept_from_call_to_call():
    shape, q = ArmShape(PUMA560), np.array(PUMA560.q_start)
    first = shape.pieces(q, 0.08)
    shape.pieces(q + 0.5, 0.0)
    assert all(np.array_equal(a, b) for a, b in zip(first, shape.pieces(q, 0.08), strict=True))


@pytest.mark.parametrize(
    ("geometry", "half"),
    [
        ("<box><size>0.2 0.1 0.06</size></box>", (0.1, 0.05, 0.03)),
        ("<cylinder><radius>0.05</radius><length>0.2</length></cylinder>", (0.05, 0.05, 0.1)),
        ("<capsule><radius>0.05</radius><length>0.2</length></capsule>", (0.05, 0.05, 0.15)),
        ("<sphere><radius>0.05</radius></sphere>", (0.05, 0.05, 0.05)),
        ("<ellipsoid><radii>0.02 0.05 0.1</radii></ellipsoid>", (0.02, 0.05, 0.1)),
    ],
    ids=["box", "cylinder", "capsule", "sphere", "ellipsoid"],
)
def test_every_shape_has_its_extent(tmp_path, geometry, half, arm_model):
    q = np.array(PUMA560.q_start)
    hand = ArmShape(with_hand(tmp_path, geometry)).pieces(q)[-1]
    X_WT = arm_model.tool_pose(q)
    in_hand = (X_WT.inverse() @ hand.T).T + [-0.1, 0.0, 0.15]
    for axis, extent in zip(AXES, 2 * half):
        assert reach(in_hand, axis) == pytest.approx(extent, abs=2 * TOLERANCE)


def test_a_shape_without_a_hull_is_refused(tmp_path):
    plane = "<plane><normal>0 0 1</normal><size>1 1</size></plane>"
    with pytest.raises(DrakeTrackerError, match="look of the arm is a HalfSpace, which has no hull"):
        ArmShape(with_hand(tmp_path, plane))
