"""The mesh files are exactly what the scripts beside them write."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from drake_tracker.world.visual_mesh import obj_text

MODELS = Path(__file__).resolve().parents[2] / "models"


@pytest.mark.parametrize("folder", sorted(path.parent.name for path in MODELS.glob("*/make_meshes.py")))
def test_scripts_write_the_meshes_that_are_there(folder, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(MODELS.parent)
    script = importlib.import_module(f"models.{folder}.make_meshes")
    script.write_model(tmp_path, script.PARTS, script.PALETTE)
    written = sorted(tmp_path.iterdir())
    assert {path.suffix for path in written} == {".obj", ".mtl", ".png"}
    for path in written:
        assert path.read_bytes() == (MODELS / folder / path.name).read_bytes(), path.name


def test_obj_text():
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, -0.0]])
    normals = np.array([[0.0, 0.0, 1.0]])
    text = obj_text(vertices, normals, [[(0, 0), (1, 0), (2, 0)]], vertex_decimals=1, normal_decimals=0)
    assert text == "v 0.0 0.0 0.0\nv 1.0 0.0 0.0\nv 0.0 1.0 0.0\nvn 0 0 1\nf 1//1 2//1 3//1\n"
    textured = obj_text(
        vertices,
        normals,
        [[(0, 1, 0), (1, 1, 0), (2, 0, 0)]],
        texture=np.array([[0.25, 0.5], [0.75, 0.5]]),
        header=["#"],
    )
    assert textured.startswith("#\nvt 0.25000 0.5\nvt 0.75000 0.5\nv 0.00000")
    assert textured.endswith("f 1/2/1 2/2/1 3/1/1\n")
