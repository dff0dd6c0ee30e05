"""Builds the visual meshes of the models: simple solids and lofts, each of one colour, merged into one OBJ per link.

There is one mesh per link, not one visual per part: the time to render a small image grows with the number of visuals,
and hardly with the number of triangles. The colours come from a palette, a small texture with one cell per colour; all
corners of a part refer to the middle of their colour's cell.

A solid is a tuple (vertices (n, 3) [m], normals (n, 3), triangles (m, 3) of indices); a part is a tuple (solid, name of
its colour).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.world.visual_mesh import obj_text

Solid = tuple[np.ndarray, np.ndarray, np.ndarray]
Part = tuple[Solid, str]
Palette = Mapping[str, tuple[float, float, float]]

SIDES, FINE_SIDES, LARGE = 24, 64, 0.03
"""Sides of a round part, and of one with a large radius [m], whose corners must not show in the images as it turns."""
CELL = 8
"""Side of a colour's cell in the palette [px]."""
NORMAL_DECIMALS = 3
ALONG_X = (0.0, np.pi / 2.0, 0.0)
ALONG_Y = (np.pi / 2.0, 0.0, 0.0)


def box(size: Sequence[float]) -> Solid:
    """Returns a box of size (x, y, z) centred on the origin."""
    vertices, normals, triangles = [], [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            normal = np.zeros(3)
            normal[axis] = sign
            u, v = np.roll(np.eye(3), -axis - 1, axis=0)[:2]
            corners = [normal + i * u + j * v for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            corners = corners if sign > 0.0 else corners[::-1]
            triangles += [len(vertices) + np.array(t) for t in ((0, 1, 2), (0, 2, 3))]
            vertices += corners
            normals += [normal] * 4
    return 0.5 * np.array(vertices) * size, np.array(normals), np.array(triangles)


def cylinder(radius: float, length: float) -> Solid:
    """Returns a cylinder about z, centred on the origin."""
    sides = SIDES if radius < LARGE else FINE_SIDES
    return loft([disc_ring(radius, height, sides) for height in (-0.5 * length, 0.5 * length)])


def ellipsoid(radii: Sequence[float]) -> Solid:
    """Returns an ellipsoid of semi-axes (x, y, z) centred on the origin."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 11)[1:-1]
    unit = np.array([disc_ring(np.cos(a), np.sin(a)) for a in angle])
    vertices, _, triangles = loft(unit)
    normals = vertices / np.asarray(radii)
    return vertices * radii, normals / np.linalg.norm(normals, axis=1, keepdims=True), triangles


def hull_ring(circles: Sequence[Sequence[float]], height: float, sides: int = SIDES) -> np.ndarray:
    """Returns points (sides, 3) around the convex hull of circles (x, y, radius) at z = height, counter-clockwise.

    They are sampled by the direction of the outline's normal, so that the points of rings of different size correspond.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False) + np.pi / sides
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    centre = np.array([circle[:2] for circle in circles])
    radius = np.array([circle[2] for circle in circles])
    support = np.argmax(normal @ centre.T + radius, axis=1)
    xy = centre[support] + radius[support, None] * normal
    return np.column_stack([xy, np.full(sides, height)])


def disc_ring(radius: float, height: float, sides: int = SIDES) -> np.ndarray:
    """Returns points (sides, 3) of a circle about z."""
    return hull_ring([(0.0, 0.0, radius)], height, sides)


def box_ring(x: float, half_x: float, half_y: float, corner: float, height: float, sides: int = 48) -> np.ndarray:
    """Returns points (sides, 3) of a rectangle with rounded corners of radius ``corner``, centred on (x, 0)."""
    dx, dy = half_x - corner, half_y - corner
    return hull_ring([(x + i * dx, j * dy, corner) for i in (-1, 1) for j in (-1, 1)], height, sides)


def rounded_slab(circles: Sequence[Sequence[float]], bottom: float, top: float, bevel: float, sides: int = 64) -> Solid:
    """Returns a slab with the hull of circles as its outline and quarter-round edges of radius ``bevel``."""
    quarter = np.linspace(0.0, 0.5 * np.pi, 5)

    def ring(inset: float, height: float) -> np.ndarray:
        return hull_ring([(x, y, radius - inset) for x, y, radius in circles], height, sides)

    lower = [ring(bevel * (1.0 - np.sin(a)), bottom + bevel * (1.0 - np.cos(a))) for a in quarter]
    upper = [ring(bevel * (1.0 - np.cos(a)), top - bevel * (1.0 - np.sin(a))) for a in quarter]
    return loft(lower + upper)


def loft(rings: Sequence[np.ndarray] | np.ndarray) -> Solid:
    """Returns the surface through rings (n, sides, 3), from lower to upper, closed by a flat cap at both ends."""
    grid = np.array(rings)
    rows, sides = grid.shape[:2]
    normal = np.cross(np.roll(grid, -1, axis=1) - np.roll(grid, 1, axis=1), np.gradient(grid, axis=0))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    index = np.arange(rows * sides).reshape(rows, sides)
    low, high = index[:-1], index[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    triangles = [np.stack([low, low_next, high_next], axis=-1), np.stack([low, high_next, high], axis=-1)]
    vertices, normals = [grid.reshape(-1, 3)], [normal.reshape(-1, 3)]
    first = rows * sides
    for ring, direction in ((grid[0], -1.0), (grid[-1], 1.0)):
        vertices += [ring, ring.mean(axis=0, keepdims=True)]
        normals.append(np.tile([0.0, 0.0, direction], (sides + 1, 1)))
        rim = first + np.arange(sides)
        fan = np.stack([np.full(sides, first + sides), rim, np.roll(rim, -1)], axis=-1)
        triangles.append(fan if direction > 0.0 else fan[:, ::-1])
        first += sides + 1
    return np.vstack(vertices), np.vstack(normals), np.vstack([t.reshape(-1, 3) for t in triangles])


def part(
    solid: Solid,
    colour: str,
    xyz: Sequence[float] = (0.0, 0.0, 0.0),
    rpy: Sequence[float] = (0.0, 0.0, 0.0),
) -> Part:
    """Returns a solid at a position [m] and roll-pitch-yaw about fixed axes [rad], in a colour of the palette."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    R = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ [[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]]
    R = R @ [[1, 0, 0], [0, cr, -sr], [0, sr, cr]]
    vertices, normals, triangles = solid
    return (vertices @ R.T + xyz, normals @ R.T, triangles), colour


def write_palette(folder: Path, palette: Palette) -> None:
    """Writes palette.png and palette.mtl for colours {name: (r, g, b) in 0..1}."""
    row = np.round(255.0 * np.array([rgb[::-1] for rgb in palette.values()])).astype(np.uint8)
    image = np.repeat(np.repeat(row[None], CELL, axis=0), CELL, axis=1)
    cv2.imwrite(str(folder / "palette.png"), image)
    (folder / "palette.mtl").write_text("newmtl palette\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nmap_Kd palette.png\n")


def link_text(parts: Sequence[Part], palette: Palette) -> str:
    """Returns the OBJ text of a link; its material is the palette in the same folder. Equal normals are shared."""
    names = list(palette)
    texture = np.array([[(i + 0.5) / len(names), 0.5] for i in range(len(names))])
    directions: dict[tuple[float, ...], int] = {}
    faces = []
    count = 0
    for (vertices, normals, triangles), colour in parts:
        keys = [tuple(row) for row in (np.round(normals, NORMAL_DECIMALS) + 0.0).tolist()]
        normal_index = [directions.setdefault(key, len(directions)) for key in keys]
        cell = names.index(colour)
        faces += [[(count + i, cell, normal_index[i]) for i in triangle] for triangle in triangles.tolist()]
        count += len(vertices)
    return obj_text(
        np.vstack([vertices for (vertices, _, _), _ in parts]),
        np.array(list(directions)),
        faces,
        texture=texture,
        header=["# written by make_meshes.py", "mtllib palette.mtl", "usemtl palette"],
        normal_decimals=NORMAL_DECIMALS,
    )


def write_model(folder: Path, links: Mapping[str, Sequence[Part]], palette: Palette) -> None:
    """Writes the palette and, for each of ``links`` {name: parts}, ``<name>.obj`` into a folder."""
    write_palette(folder, palette)
    for link, parts in links.items():
        (folder / f"{link}.obj").write_text(link_text(parts, palette))
