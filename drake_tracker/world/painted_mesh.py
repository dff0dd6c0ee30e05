"""Meshes of the package's models in other colours, without further files: the texture is changed in memory.

A model has one OBJ file, whose material refers to one texture. The texture of a train is a palette with one cell per
colour; the texture of the table is an image of wood.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

CELL = 8
"""Side of a colour's cell in a palette [px]."""
Paint = Callable[[np.ndarray], np.ndarray]
"""Changes a texture, shape (h, w, 3), uint8, BGR."""


def palette_paint(cells: Sequence[int], rgb: np.ndarray) -> Paint:
    """Returns the paint that changes some colours of a palette.

    Args:
        cells: numbers of the colours, from 0.
        rgb: their new colour, from 0 to 1, shape (3,).
    """

    def paint(texture: np.ndarray) -> np.ndarray:
        painted = texture.copy()
        for cell in cells:
            painted[:, CELL * cell : CELL * (cell + 1)] = np.round(255.0 * rgb[::-1])
        return painted

    return paint


def stain(rgb: np.ndarray) -> Paint:
    """Returns the paint that gives a texture another mean colour and keeps its pattern of light and dark.

    Where the pattern would be lighter than white, it is white.

    Args:
        rgb: the mean colour, from 0 to 1, shape (3,).
    """

    def paint(texture: np.ndarray) -> np.ndarray:
        grey = texture.mean(axis=2, keepdims=True)
        return np.clip(np.round(255.0 * rgb[::-1] * grey / grey.mean()), 0, 255).astype(np.uint8)

    return paint


def paint_visual(plant: MultibodyPlant, scene_graph: SceneGraph, *, body: RigidBody, name: str, paint: Paint) -> None:
    """Changes the texture of a mesh of a body; its geometry and all roles stay.

    Args:
        plant: registered with ``scene_graph``.
        scene_graph: before any Context is made of it.
        body: of the plant.
        name: of the visual geometry, with the model's name before it: "train::look".
        paint: the change.
    """
    inspector = scene_graph.model_inspector()
    for geometry in plant.GetVisualGeometriesForBody(body):
        if inspector.GetName(geometry) == name:
            mesh = painted_mesh(inspector.GetShape(geometry), paint)
            scene_graph.ChangeShape(plant.get_source_id(), geometry, mesh)


def painted_mesh(mesh: Mesh, paint: Paint) -> Mesh:
    """Returns a mesh with a changed texture, all of whose files are in memory.

    Args:
        mesh: an OBJ file on the disk, with one material file, which refers to one PNG image, both in its folder.
        paint: the change.
    """
    path = Path(mesh.source().path())
    material = next(line.split()[1] for line in path.read_text().splitlines() if line.startswith("mtllib"))
    texture = next(
        line.split()[1] for line in (path.parent / material).read_text().splitlines() if line.startswith("map_Kd")
    )
    painted = cv2.imencode(".png", paint(cv2.imread(str(path.parent / texture))))[1].tobytes()
    files = {material: (path.parent / material).read_bytes(), texture: painted}
    return memory_mesh(path.name, path.read_bytes(), files, mesh.scale3())


def memory_mesh(name: str, contents: bytes, files: dict[str, bytes], scale3: np.ndarray) -> Mesh:
    """Returns a mesh whose files are in memory.

    Args:
        name: of the OBJ file.
        contents: of the OBJ file.
        files: {name: contents} of its material and its texture.
        scale3: factors along the axes of the mesh, shape (3,).
    """
    supporting = {each: _memory_file(each, data) for each, data in files.items()}
    return Mesh(InMemoryMesh(mesh_file=_memory_file(name, contents), supporting_files=supporting), scale3=scale3)


def _memory_file(name: str, contents: bytes) -> MemoryFile:
    return MemoryFile(contents=contents, extension=Path(name).suffix, filename_hint=name)
