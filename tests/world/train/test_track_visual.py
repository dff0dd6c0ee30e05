import numpy as np
import pytest
from pydrake.geometry import Mesh, Role
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.world.config import TRACK_KINDS
from drake_tracker.world.train.track_visual import (
    GAUGE,
    RAIL_SIZE,
    SLEEPER_SIZE,
    SUNK,
    add_track_visual,
    rail_mesh,
    sleeper_mesh,
)
from drake_tracker.world.train.tracks import make_track

KINDS = [kind for kind in TRACK_KINDS if kind != "csv"]


def volume(vertices, faces):
    """Volume [m^3] between the outward faces and the plane z = -SUNK, by the divergence theorem."""
    shifted = vertices + [0.0, 0.0, SUNK]
    return sum(
        np.dot(shifted[face[0]], np.cross(shifted[face[k]], shifted[face[k + 1]])) / 6.0
        for face in faces
        for k in range(1, len(face) - 1)
    )


@pytest.mark.parametrize("kind", KINDS)
def test_rails_lie_on_the_table_on_both_sides_of_the_track(kind):
    track = make_track(kind)
    vertices, faces = rail_mesh(track)
    assert vertices[:, 2].max() < 0.002 and vertices[:, 2].min() == -SUNK
    # A rail of the wrong winding would be dark or missing in a viewer: its volume would come out negative.
    assert volume(vertices, faces) == pytest.approx(2 * track.length * RAIL_SIZE[0] * (RAIL_SIZE[1] + SUNK), rel=0.01)
    for x, y, _ in vertices[::16]:
        gaps = np.abs(np.hypot(*(track.points - (x, y)).T).min() - 0.5 * GAUGE)
        assert gaps < RAIL_SIZE[0] or kind == "figure_eight"  # where it crosses itself, the other branch is nearer


def test_sleepers_are_boxes_across_the_track():
    track = make_track("oval")
    vertices, faces = sleeper_mesh(track)
    count = len(vertices) // 8
    assert volume(vertices, faces) == pytest.approx(count * np.prod(SLEEPER_SIZE[:2]) * (SLEEPER_SIZE[2] + SUNK))
    first = vertices[:4, :2]
    x, y, heading = track.pose(0.0)
    np.testing.assert_allclose(first.mean(axis=0), [x, y], atol=1e-12)
    across = first[2] - first[1]
    np.testing.assert_allclose(across, SLEEPER_SIZE[1] * np.array([-np.sin(heading), np.cos(heading)]), atol=1e-12)


def test_it_is_seen_and_never_touched():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    add_track_visual(plant, track=make_track("oval"), table_height=0.45)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    assert inspector.NumGeometriesWithRole(Role.kProximity) == 0
    for role in (Role.kPerception, Role.kIllustration):
        shapes = [inspector.GetShape(geometry) for geometry in inspector.GetAllGeometryIds(role)]
        assert len(shapes) == 2 and all(isinstance(shape, Mesh) for shape in shapes)
    for geometry in inspector.GetAllGeometryIds(Role.kPerception):
        assert inspector.GetPoseInFrame(geometry).translation()[2] == 0.45
