"""Builds the visual meshes of the models: simple solids and lofts, each of one colour, merged into one OBJ for a link.

One mesh for a link, not one visual for a part: the time to render a small image grows with the number of visuals,
hardly with the number of triangles. The colours come from a palette, a tiny texture of one cell for a colour; all
corners of a part point at the middle of their colour's cell.

A solid is a tuple (vertices (n, 3) [m], normals (n, 3), triangles (m, 3) of indices); a part is (solid, colour's name).
"""

from pathlib import Path

import cv2
import numpy as np

SIDES, FINE_SIDES, LARGE = 24, 64, 0.03
"""Sides of a round part, and of one whose radius [m] is large: a turning polygon must not show in the images."""
CELL = 8
"""Side of a colour's cell in the palette [px]."""
ALONG_X = (0.0, np.pi / 2.0, 0.0)
ALONG_Y = (np.pi / 2.0, 0.0, 0.0)


def box(size):
    """A box of size (x, y, z) centred on the origin."""
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


def cylinder(radius, length):
    """A cylinder about z, centred on the origin."""
    sides = SIDES if radius < LARGE else FINE_SIDES
    return loft([disc_ring(radius, height, sides) for height in (-0.5 * length, 0.5 * length)])


def ellipsoid(radii):
    """An ellipsoid of semi-axes (x, y, z) centred on the origin."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 11)[1:-1]
    unit = np.array([disc_ring(np.cos(a), np.sin(a)) for a in angle])
    vertices, _, triangles = loft(unit)
    normals = vertices / np.asarray(radii)
    return vertices * radii, normals / np.linalg.norm(normals, axis=1, keepdims=True), triangles


def hull_ring(circles, height, sides=SIDES):
    """Points (sides, 3) at z = height around the convex hull of circles [(x, y, radius), ...], counter-clockwise.

    They are sampled by the direction of the outline's normal, so that rings of different size correspond.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False) + np.pi / sides
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    centre = np.array([circle[:2] for circle in circles])
    radius = np.array([circle[2] for circle in circles])
    support = np.argmax(normal @ centre.T + radius, axis=1)
    xy = centre[support] + radius[support, None] * normal
    return np.column_stack([xy, np.full(sides, height)])


def disc_ring(radius, height, sides=SIDES):
    """A circle about z."""
    return hull_ring([(0.0, 0.0, radius)], height, sides)


def box_ring(x, half_x, half_y, corner, height, sides=48):
    """A rectangle with rounded corners, centred on (x, 0)."""
    dx, dy = half_x - corner, half_y - corner
    return hull_ring([(x + i * dx, j * dy, corner) for i in (-1, 1) for j in (-1, 1)], height, sides)


def rounded_slab(circles, bottom, top, bevel, sides=64):
    """A slab with the hull of circles as its outline and quarter-round edges."""
    quarter = np.linspace(0.0, 0.5 * np.pi, 5)

    def ring(inset, height):
        return hull_ring([(x, y, radius - inset) for x, y, radius in circles], height, sides)

    lower = [ring(bevel * (1.0 - np.sin(a)), bottom + bevel * (1.0 - np.cos(a))) for a in quarter]
    upper = [ring(bevel * (1.0 - np.cos(a)), top - bevel * (1.0 - np.sin(a))) for a in quarter]
    return loft(lower + upper)


def loft(rings):
    """The surface through rings (n, sides, 3), from lower to upper, closed by a flat cap at both ends."""
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


def part(solid, colour, xyz=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)):
    """A solid in its place, roll-pitch-yaw about fixed axes [rad], in a colour of the palette."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    R = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ [[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]]
    R = R @ [[1, 0, 0], [0, cr, -sr], [0, sr, cr]]
    vertices, normals, triangles = solid
    return (vertices @ R.T + xyz, normals @ R.T, triangles), colour


def write_palette(folder, palette):
    """Writes palette.png and palette.mtl for colours {name: (r, g, b) in 0..1}."""
    row = np.round(255.0 * np.array([rgb[::-1] for rgb in palette.values()])).astype(np.uint8)
    image = np.repeat(np.repeat(row[None], CELL, axis=0), CELL, axis=1)
    cv2.imwrite(str(folder / "palette.png"), image)
    (folder / "palette.mtl").write_text("newmtl palette\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nmap_Kd palette.png\n")


def write_obj(path, parts, palette):
    """Writes a link's mesh of ``parts``; its material is the palette of the same folder."""
    names = list(palette)
    lines = ["# written by make_meshes.py", "mtllib palette.mtl", "usemtl palette"]
    lines += [f"vt {(i + 0.5) / len(names):.5f} 0.5" for i in range(len(names))]
    directions, faces = {}, []
    count = 0
    for (vertices, normals, triangles), colour in parts:
        lines += ["v {:.5f} {:.5f} {:.5f}".format(*(v + 0.0)) for v in vertices]
        keys = ["vn {:.3f} {:.3f} {:.3f}".format(*(np.round(n, 3) + 0.0)) for n in normals]
        normal_index = [directions.setdefault(key, len(directions) + 1) for key in keys]
        texture = names.index(colour) + 1
        for triangle in triangles:
            faces.append("f " + " ".join(f"{count + i + 1}/{texture}/{normal_index[i]}" for i in triangle))
        count += len(vertices)
    path.write_text("\n".join(lines + list(directions) + faces) + "\n")


def write_model(script, links, palette):
    """Writes the palette and, for each of ``links`` {name: parts}, ``<name>.obj`` beside the file ``script``."""
    folder = Path(script).resolve().parent
    write_palette(folder, palette)
    for link, parts in links.items():
        write_obj(folder / f"{link}.obj", parts, palette)
