"""The text of a Wavefront OBJ file: the only place where meshes are written."""

from collections.abc import Iterable, Sequence

import numpy as np

TEXTURE_DECIMALS = 5


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
