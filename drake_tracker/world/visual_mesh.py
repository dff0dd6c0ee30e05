"""Meshes made by code: looks without collision, one mesh for a colour.

The time to render a small image grows with the number of visuals, hardly with the number of triangles. A mesh is
(vertices (n, 3) [m], faces), each face a flat convex polygon: a tuple of vertex numbers, counter-clockwise seen from
outside.
"""

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh


def add_visual_mesh(plant, body, X_BG, vertices, faces, name, colour):
    """Gives ``body`` the look of a mesh at X_BG, with the illustration and the perception role.

    The plant must be registered with a SceneGraph and not yet be finalized. ``colour`` is (r, g, b, a).
    """
    text = MemoryFile(contents=obj_text(vertices, faces), extension=".obj", filename_hint=name)
    plant.RegisterVisualGeometry(body, X_BG, Mesh(InMemoryMesh(mesh_file=text)), name, np.array(colour))


def prism(outline, bottom, top):
    """Returns the mesh of an upright prism on ``outline`` (n, 2) [m], convex, counter-clockwise, bottom to top [m]."""
    n = len(outline)
    vertices = np.vstack([np.column_stack([outline, np.full(n, height)]) for height in (bottom, top)])
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    return vertices, [*sides, tuple(range(n))[::-1], tuple(range(n, 2 * n))]


def disc(centre, radius, sides=32):
    """Returns the outline (sides, 2) [m] of a disc."""
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def rectangle(centre, width, height):
    """Returns the outline (4, 2) [m] of a rectangle, ``width`` along x."""
    return np.asarray(centre) + 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])


def merge(meshes):
    """Returns one mesh of several."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [tuple(int(k + n) for k in face) for n, (_, part) in zip(offsets, meshes, strict=False) for face in part]
    return np.concatenate([vertices for vertices, _ in meshes]), faces


def obj_text(vertices, faces):
    """Returns the text of a Wavefront OBJ file whose triangles have their own flat normals."""
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices]
    for number, face in enumerate(faces, start=1):
        a, b, c = vertices[list(face[:3])]
        normal = np.cross(b - a, c - a)
        lines.append("vn {:.4f} {:.4f} {:.4f}".format(*normal / np.linalg.norm(normal)))
        for k in range(1, len(face) - 1):
            lines.append("f " + " ".join(f"{face[i] + 1}//{number}" for i in (0, k, k + 1)))
    return "\n".join(lines) + "\n"
