"""Meshes made by code: appearance without collision geometry, one mesh for each colour.

The time to render a small image grows with the number of visuals, and hardly with the number of triangles. A mesh is
(vertices (n, 3) [m], faces), each face a flat convex polygon: a tuple of vertex indices, counter-clockwise as seen from
outside.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

Face = tuple[int, ...]
FlatMesh = tuple[np.ndarray, list[Face]]
Colour = tuple[float, float, float, float]
TEXTURE_DECIMALS = 5


def add_visual_mesh(
    plant: MultibodyPlant, *, body: RigidBody, X_BG: RigidTransform, mesh: FlatMesh, name: str, colour: Colour
) -> None:
    """Adds a mesh to the appearance of a body, with the illustration and the perception role.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        body: of the plant.
        X_BG: pose of the mesh in the body's frame.
        mesh: (vertices, faces).
        name: name of the geometry.
        colour: (r, g, b, a), each from 0 to 1.
    """
    add_visual_obj(plant, body=body, X_BG=X_BG, text=flat_obj_text(mesh), name=name, colour=colour)


def add_visual_obj(
    plant: MultibodyPlant, *, body: RigidBody, X_BG: RigidTransform, text: str, name: str, colour: Colour
) -> None:
    """As `add_visual_mesh`, from the ``text`` of an OBJ file."""
    file = MemoryFile(contents=text, extension=".obj", filename_hint=name)
    plant.RegisterVisualGeometry(body, X_BG, Mesh(InMemoryMesh(mesh_file=file)), name, np.array(colour))


def prism(outline: np.ndarray, bottom: float, top: float) -> FlatMesh:
    """Returns the mesh of an upright prism.

    Args:
        outline: shape (n, 2) [m], convex, counter-clockwise.
        bottom: height of the lower face [m].
        top: height of the upper face [m].
    """
    n = len(outline)
    vertices = np.vstack([np.column_stack([outline, np.full(n, height)]) for height in (bottom, top)])
    sides: list[Face] = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    return vertices, [*sides, tuple(range(n))[::-1], tuple(range(n, 2 * n))]


def disc(centre: Sequence[float] | np.ndarray, radius: float, sides: int = 32) -> np.ndarray:
    """Returns the outline of a disc, shape (sides, 2) [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def rectangle(centre: Sequence[float] | np.ndarray, width: float, height: float) -> np.ndarray:
    """Returns the outline of a rectangle, shape (4, 2) [m], with ``width`` along x and ``height`` along y."""
    return np.asarray(centre) + 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])


def merge(meshes: Sequence[FlatMesh]) -> FlatMesh:
    """Returns several meshes as one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces: list[Face] = [
        tuple(int(k + n) for k in face) for n, (_, part) in zip(offsets, meshes, strict=False) for face in part
    ]
    return np.concatenate([vertices for vertices, _ in meshes]), faces


def flat_obj_text(mesh: FlatMesh) -> str:
    """Returns the OBJ text of a mesh whose faces are split into triangles, each face with its own normal."""
    vertices, faces = mesh
    a, b, c = np.moveaxis(vertices[[face[:3] for face in faces]], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.sqrt([[normal @ normal] for normal in normals])
    triangles = [
        [(face[i], number) for i in (0, k, k + 1)] for number, face in enumerate(faces) for k in range(1, len(face) - 1)
    ]
    return obj_text(vertices, normals, triangles)


def obj_text(
    vertices: np.ndarray,
    normals: np.ndarray,
    faces: Iterable[Sequence[tuple[int, ...]]],
    *,
    texture: np.ndarray | None = None,
    header: Sequence[str] = (),
    vertex_decimals: int = 5,
    normal_decimals: int = 4,
) -> str:
    """Returns the text of an OBJ file.

    Args:
        vertices: shape (n, 3) [m].
        normals: unit vectors, shape (m, 3).
        faces: flat convex polygons, counter-clockwise as seen from outside. Each is a sequence of corners
            (vertex, normal), or (vertex, texture coordinate, normal) when there is a texture: indices from 0.
        texture: texture coordinates (u, v) from 0 to 1, shape (k, 2).
        header: lines that come first, such as the name of a material file.
        vertex_decimals: decimals of the vertices.
        normal_decimals: decimals of the normals.
    """
    lines = list(header)
    if texture is not None:
        lines += [f"vt {u:.{TEXTURE_DECIMALS}f} {v:g}" for u, v in texture]
    lines += _rows("v", vertices, vertex_decimals)
    lines += _rows("vn", normals, normal_decimals)
    separator = "//" if texture is None else "/"
    for face in faces:
        lines.append("f " + " ".join(separator.join(str(index + 1) for index in corner) for corner in face))
    return "\n".join(lines) + "\n"


def _rows(keyword: str, rows: np.ndarray, decimals: int) -> list[str]:
    """Returns one line for each row of three numbers; adding zero turns -0.0 into 0.0."""
    template = f"{keyword} {{:.{decimals}f}} {{:.{decimals}f}} {{:.{decimals}f}}"
    return [template.format(*row) for row in (np.asarray(rows, dtype=float) + 0.0).tolist()]
