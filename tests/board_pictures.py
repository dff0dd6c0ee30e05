"""Pictures of calibration boards through any lens."""

import functools

import cv2
import numpy as np

_TEXELS = 80
"""Texels along a square."""


@functools.cache
def draw(board, margin=1.0):
    """The picture of a board with a white margin, and the pose of its first texel and the size of a texel [m]."""
    lower, upper = board.shapes().box()
    lower, upper = lower - margin * board.square, upper + margin * board.square
    texel = board.square / _TEXELS
    width, height = np.ceil((upper - lower) / texel).astype(int)
    picture = np.full((height, width), 200, np.uint8)
    shift = 8
    for x, y, w, h in board.shapes().rectangles:
        # A polygon of OpenCV includes its outline, half a texel beyond.
        low, high = (np.array([[x, y], [x + w, y + h]]) - lower) / texel + [[0.0], [-1.0]]
        corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        cv2.fillConvexPoly(picture, np.round(corners * 2**shift).astype(np.int32), 12, cv2.LINE_AA, shift)
    for x, y, r in board.shapes().circles:
        centre = (np.array([x, y]) - lower) / texel - 0.5
        cv2.circle(
            picture, np.round(centre * 2**shift).astype(int), round(r / texel * 2**shift), 12, -1, cv2.LINE_AA, shift
        )
    return picture, lower + 0.5 * texel, texel


def photograph(board, camera, X_WB, noise=1.0, seed=0):
    """The grey image that a camera takes of a board at the pose X_WB, four rays to a pixel."""
    picture, first, texel = draw(board)
    v, u = np.mgrid[: 2 * camera.height, : 2 * camera.width]
    uv = 0.5 * np.column_stack([u.ravel(), v.ravel()]) - 0.25
    origin, directions = camera.in_frame(X_WB).rays(uv)
    p = origin + directions * (-origin[2] / directions[:, 2:])
    where = ((p[:, :2] - first) / texel).reshape(2 * camera.height, 2 * camera.width, 2).astype(np.float32)
    where[(directions[:, 2] * origin[2] >= 0.0).reshape(where.shape[:2])] = -1e4
    picture = cv2.GaussianBlur(picture, (0, 0), 1.5)
    seen = cv2.remap(picture, where[..., 0], where[..., 1], cv2.INTER_LINEAR, borderValue=90).astype(float)
    image = 0.25 * (seen[::2, ::2] + seen[1::2, ::2] + seen[::2, 1::2] + seen[1::2, 1::2])
    return (image + np.random.default_rng(seed).normal(0.0, noise, image.shape)).clip(0, 255).astype(np.uint8)


def pose(rotation, p):
    """The matrix (4, 4) of a rotation vector and a position."""
    X = np.eye(4)
    X[:3, :3] = cv2.Rodrigues(np.array(rotation, dtype=float))[0]
    X[:3, 3] = p
    return X


def held(board, rotation, depth, aside=(0.0, 0.0)):
    """The pose of a board whose middle is before a camera at the origin of W."""
    lower, upper = board.shapes().box()
    middle = np.array([*(0.5 * (lower + upper)), 0.0])
    X = pose(rotation, [*aside, depth])
    X[:3, 3] -= X[:3, :3] @ middle
    return X
