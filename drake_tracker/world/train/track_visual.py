"""The appearance of a track: two rails on sleepers on the table, or on an embankment, without collision geometry."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_tracker.world.train.hill import track_frame
from drake_tracker.world.train.tracks import Track
from drake_tracker.world.visual_mesh import Face, FlatMesh, add_visual_mesh

GAUGE = 0.032  # [m] between the rails' centre lines: the distance of the train's wheels
RAIL_SIZE = (0.0024, 0.0018)  # [m] width, height of a rail's top above the table
SLEEPER_SIZE = (0.008, 0.048, 0.0009)  # [m] along, across, height of its top above the table
SLEEPER_SPACING = 0.020  # [m]
RAIL_STEP = 0.004  # [m] length of a piece of rail
SUNK = 0.0005  # [m] depth of the undersides in the table, so that no two faces coincide

# Dark, so that the track stays in the background and the train stands out.
RAIL_COLOUR = (0.20, 0.20, 0.22, 1.0)
SLEEPER_COLOUR = (0.13, 0.09, 0.06, 1.0)
EMBANKMENT_COLOUR = (0.17, 0.15, 0.12, 1.0)
EMBANKMENT_WIDTH = 0.056  # [m] of the wall that carries a track with heights


def add_track_visual(plant: MultibodyPlant, *, track: Track, table_height: float, name: str = "track") -> None:
    """Adds the appearance of a track to a plant, as meshes fixed to its world.

    The meshes have the illustration and the perception role, and neither proximity nor mass.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        track: the track.
        table_height: height of the table's top in W [m].
        name: of the track, with which the names of the meshes begin.
    """
    X_WG = RigidTransform([0.0, 0.0, table_height])
    parts = [("rails", rail_mesh(track), RAIL_COLOUR), ("sleepers", sleeper_mesh(track), SLEEPER_COLOUR)]
    parts += [] if track.heights is None else [("embankment", embankment_mesh(track), EMBANKMENT_COLOUR)]
    for part, mesh, colour in parts:
        add_visual_mesh(plant, body=plant.world_body(), X_BG=X_WG, mesh=mesh, name=f"{name}_{part}", colour=colour)


def rail_mesh(track: Track) -> FlatMesh:
    """Returns the mesh of both rails; z is the height above the table."""
    pieces = max(round(track.length / RAIL_STEP), 8)
    s = np.linspace(0.0, track.length, pieces + 1)[: pieces if track.closed else pieces + 1]
    half_width, top = 0.5 * RAIL_SIZE[0], RAIL_SIZE[1]
    section = [(-half_width, -SUNK), (half_width, -SUNK), (half_width, top), (-half_width, top)]
    vertices: list[np.ndarray] = []
    faces: list[Face] = []
    for side in (-0.5 * GAUGE, 0.5 * GAUGE):
        first = 4 * len(s) * len(vertices)
        edges = [_beside(track, s, side + across, height) for across, height in section]
        vertices.append(np.stack(edges, axis=1).reshape(-1, 3))
        for i in range(pieces):
            here, there = first + 4 * i, first + 4 * ((i + 1) % len(s))
            faces += [(here + k, here + (k + 1) % 4, there + (k + 1) % 4, there + k) for k in (1, 2, 3)]
        if not track.closed:
            faces += [tuple(first + np.arange(4)[::-1]), tuple(first + 4 * pieces + np.arange(4))]  # the ends
    return np.concatenate(vertices), faces


def sleeper_mesh(track: Track) -> FlatMesh:
    """Returns the mesh of the sleepers, boxes across the track without an underside; z as in `rail_mesh`."""
    count = max(round(track.length / SLEEPER_SPACING), 2)
    s = np.linspace(0.0, track.length, count, endpoint=not track.closed)
    along, across, top = SLEEPER_SIZE
    x, y, heading = track.pose(s)
    centre = np.column_stack([x, y])[:, None]
    tangent = np.column_stack([np.cos(heading), np.sin(heading)])[:, None]
    normal = tangent[..., ::-1] * (-1.0, 1.0)
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    ground = centre + along * corners[:, :1] * tangent + across * corners[:, 1:] * normal
    if track.heights is None:
        layers = [np.concatenate([ground, np.full((count, 4, 1), height)], axis=2) for height in (-SUNK, top)]
    else:
        corner = [(along * a, across * b) for a, b in corners]
        layers = [
            np.stack([_beside(track, s + ahead, aside, height) for ahead, aside in corner], axis=1)
            for height in (-SUNK, top)
        ]
    sides = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    faces = [tuple(8 * i + np.array(face)) for i in range(count) for face in (*sides, (4, 5, 6, 7))]
    return np.concatenate(layers, axis=1).reshape(-1, 3), faces


def embankment_mesh(track: Track) -> FlatMesh:
    """Returns the mesh of the wall under a track with heights, whose top follows the track; z as in `rail_mesh`."""
    pieces = max(round(track.length / RAIL_STEP), 8)
    s = np.linspace(0.0, track.length, pieces + 1)[: pieces if track.closed else pieces + 1]
    right, left = (_beside(track, s, side * 0.5 * EMBANKMENT_WIDTH, -SUNK) for side in (-1.0, 1.0))
    on_table = (np.column_stack([edge[:, :2], np.full(len(s), -SUNK)]) for edge in (right, left))
    vertices = np.stack([right, left, *on_table], axis=1).reshape(-1, 3)
    faces: list[Face] = []
    for i in range(pieces):
        here, there = 4 * i, 4 * ((i + 1) % len(s))
        faces += [(here, there, there + 1, here + 1)]
        faces += [(here + 2, there + 2, there, here), (here + 1, there + 1, there + 3, here + 3)]
    if not track.closed:
        faces += [(0, 1, 3, 2), tuple(4 * pieces + np.array([0, 2, 3, 1]))]
    return vertices, faces


def _beside(track: Track, s: np.ndarray, across: float, height: float) -> np.ndarray:
    """Returns the points (n, 3) [m] at a distance ``across`` to the left of the track and ``height`` above it."""
    x, y, heading = track.pose(s)
    if track.heights is None:
        return np.column_stack([x - across * np.sin(heading), y + across * np.cos(heading), np.full_like(x, height)])
    frames = [track_frame(np.cos(h), np.sin(h), slope, lean) for h, slope, lean in zip(heading, *track.profile(s)[1:])]
    above = track.profile(s)[0]
    return np.column_stack([x, y, above]) + np.einsum("nij,i->nj", np.array(frames), [0.0, across, height])
