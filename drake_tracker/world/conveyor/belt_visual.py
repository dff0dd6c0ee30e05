"""The appearance of the belt: a texture that repeats along it, and moves with it."""

import math

import numpy as np
from pydrake.geometry import GeometryInstance, IllustrationProperties, PerceptionProperties
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_tracker.core.models_path import models_path
from drake_tracker.world.painted_mesh import memory_mesh
from drake_tracker.world.wavefront_obj import obj_text

TILE = 0.30
"""Length along the belt of one tile of the texture [m]."""
_TEXTURE = "rubber.png"
_MATERIAL = f"newmtl rubber\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nmap_Kd {_TEXTURE}\n"


def add_belt_visual(plant: MultibodyPlant, *, body: RigidBody, width: float, low: float, high: float) -> None:
    """Adds the appearance of the upper face of a belt, the plane z = 0 of its body, to a plant.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        body: of the belt.
        width: of the belt, along x [m].
        low: y at which the belt begins [m].
        high: y up to which it reaches at least [m].
    """
    image = (models_path() / "belt" / _TEXTURE).read_bytes()
    files = {"belt.mtl": _MATERIAL.encode(), _TEXTURE: image}
    mesh = memory_mesh("belt.obj", belt_text(width, low, high).encode(), files, np.ones(3))
    look = GeometryInstance(RigidTransform(), mesh, "look")
    look.set_illustration_properties(IllustrationProperties())
    look.set_perception_properties(PerceptionProperties())
    plant.RegisterVisualGeometry(body, look)


def belt_text(width: float, low: float, high: float) -> str:
    """Returns the OBJ text of the upper face of a belt, a row of whole tiles; arguments as for `add_belt_visual`."""
    count = math.ceil((high - low) / TILE - 1e-9)
    y = low + TILE * np.arange(count + 1)
    left, right = (np.column_stack([np.full_like(y, x), y, np.zeros_like(y)]) for x in (-0.5 * width, 0.5 * width))
    vertices = np.stack([left, right], axis=1).reshape(-1, 3)
    # Corners of the texture: across the belt v, along it u.
    texture = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])
    faces = [[(2 * k, 0, 0), (2 * k + 1, 1, 0), (2 * k + 3, 2, 0), (2 * k + 2, 3, 0)] for k in range(count)]
    return obj_text(
        vertices, np.array([[0.0, 0.0, 1.0]]), faces, texture=texture, header=["mtllib belt.mtl", "usemtl rubber"]
    )
