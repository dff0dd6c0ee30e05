"""The silhouette of the robot's own arm in an image, so that its motion is not taken for the object's."""

import itertools
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel

MARGIN = 3
"""Default growth of the silhouette to every side [px]."""
NEAREST = 0.05
"""Distance [m] in front of the camera's plane at which pieces of the arm are cut."""
_SHIFT = 4
"""Fractional bits of the outlines' corners when they are filled."""
_POINTS_PER_SIDE = 9
"""Points on each side of the window that outline the visible part of the scene, because a lens bends the sides."""
_WIDTH_STEP = 0.001
"""Step of the jaws' opening in which silhouettes are drawn [m]: less than a pixel."""
_MARGIN = 2
"""Growth of the silhouette to every side [px]."""


class ArmSilhouette:
    """Draws convex pieces as a camera sees them through a window of its image.

    Depth is ignored: an object in front of the arm is masked as well. Shadows of the arm are not part of the
    silhouette.

    Args:
        camera: calibrated camera.
        window: the part of the image that the mask covers, (u0, v0, width, height) [px] of the full image.
        margin: growth of the silhouette to every side [px], for the error of the joint positions, the smoothing of the
            images and the motion between them.
    """

    def __init__(self, camera: CameraModel, window: tuple[int, int, int, int], *, margin: int = MARGIN) -> None:
        self._camera = camera
        self._margin = margin
        u0, v0, width, height = window
        self._first = np.array([[u0 - margin], [v0 - margin]])
        self._shape = (height + 2 * margin, width + 2 * margin)
        self._kernel = np.ones((2 * margin + 1, 2 * margin + 1), np.uint8)
        self._lower, self._upper = self._seen()

    def mask(self, pieces: Sequence[np.ndarray], displacement: ArrayLike = (0.0, 0.0)) -> np.ndarray:
        """Returns the mask of the window, uint8 of shape (height, width), 255 where a piece appears.

        Args:
            pieces: corners of each convex piece, p_WQ of shape (n, 3) [m], as from `ArmShape.pieces`.
            displacement: of the silhouette to the right and downwards from where the camera model projects the pieces,
                shape (2,) [px].

        Pieces behind the camera or outside of the window are skipped. A piece that crosses the camera's plane is cut
        `NEAREST` in front of it.
        """
        height, width = self._shape
        inner = slice(self._margin, height - self._margin), slice(self._margin, width - self._margin)
        canvas = np.zeros(self._shape, np.uint8)
        outlines = self._outlines(pieces, np.asarray(displacement, float))
        if outlines:
            for outline in outlines:
                cv2.fillConvexPoly(canvas, outline, 255, lineType=cv2.LINE_8, shift=_SHIFT)
            canvas = cv2.dilate(canvas, self._kernel)
        return np.ascontiguousarray(canvas[inner])

    def _outlines(self, pieces: Sequence[np.ndarray], displacement: np.ndarray) -> list[np.ndarray]:
        """Returns the outlines of those pieces that can appear in the window, in pixels of the grown mask.

        The corners are whole numbers with `_SHIFT` fractional bits.

        Args:
            pieces: corners of each piece, p_WQ of shape (n, 3) [m].
            displacement: of the silhouette, shape (2,) [px].
        """
        seen = self._in_camera(pieces, displacement)
        if not seen:
            return []
        corners = (self._pixels(np.hstack(seen)).T + displacement).astype(np.float32)
        ends = np.cumsum([xy.shape[1] for xy in seen]).tolist()
        hulls = [cv2.convexHull(corners[start:end]) for start, end in zip([0, *ends], ends)]
        return [np.rint(hull * (1 << _SHIFT)).astype(np.int32) for hull in hulls]

    def _in_camera(self, pieces: Sequence[np.ndarray], displacement: np.ndarray) -> list[np.ndarray]:
        """Returns normalised image coordinates (2, n) of those pieces that can appear in the window.

        A piece that comes too near is cut.

        Args:
            pieces: corners of each piece, p_WQ of shape (n, 3) [m].
            displacement: of the silhouette, shape (2,) [px].
        """
        if not pieces:
            return []
        X_CW = self._camera.X_CW
        starts = list(itertools.accumulate(map(len, pieces), initial=0))
        p_CQ = X_CW[:3, :3] @ np.concatenate(pieces).T + X_CW[:3, 3:]
        projected = p_CQ.copy()
        projected[:2] /= np.maximum(p_CQ[2], NEAREST)
        lowest, highest = (each.reduceat(projected, starts[:-1], axis=1) for each in (np.minimum, np.maximum))
        moved = (displacement / np.diag(self._camera.K)[:2])[:, np.newaxis]
        meets = ((lowest[:2] + moved <= self._upper) & (highest[:2] + moved >= self._lower)).all(axis=0)
        cut = (lowest[2] < NEAREST) & (highest[2] > NEAREST)
        whole = (lowest[2] >= NEAREST) & meets
        found = []
        for k in np.flatnonzero(whole | cut).tolist():
            own = slice(starts[k], starts[k + 1])
            if cut[k]:
                near = _cut(p_CQ[:, own].T).T
                found.append(near[:2] / near[2])
            else:
                found.append(projected[:2, own])
        return found

    def _pixels(self, xy: np.ndarray) -> np.ndarray:
        """Returns the pixels (2, n) of normalised image coordinates (2, n), from the first pixel of the grown mask on.

        The lens is applied within the window only. Points outside of the window have the displacement of the nearest
        point of the window, because a model of distortion is not valid far outside the image.
        """
        within = np.minimum(np.maximum(xy, self._lower), self._upper)
        uv = np.stack(self._camera.pixels(*within))
        return uv + self._camera.K[:2, :2] @ (xy - within) - self._first

    def _seen(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the lowest and the highest normalised image coordinates of the window, shape (2, 1) each."""
        height, width = self._shape
        side = np.linspace(0.0, 1.0, _POINTS_PER_SIDE)
        grid = np.array([(i, j) for i in side for j in side])
        rim = grid[((grid == 0.0) | (grid == 1.0)).any(axis=1)]
        _, directions = self._camera.rays(self._first.T - 0.5 + rim * (width, height))
        directions_C = directions @ self._camera.X_CW[:3, :3].T
        xy = directions_C[:, :2] / directions_C[:, 2:]
        return xy.min(axis=0)[:, None], xy.max(axis=0)[:, None]


def _cut(p_CQ: np.ndarray) -> np.ndarray:
    """Returns corners of the part of a convex piece (n, 3) that is more than `NEAREST` in front of the camera's plane.

    The corners on the cut are among the points at which it meets the lines between corners on its two sides.
    """
    before = p_CQ[:, 2] > NEAREST
    front, behind = p_CQ[before, None], p_CQ[None, ~before]
    fraction = (front[..., 2:] - NEAREST) / (front[..., 2:] - behind[..., 2:])
    return np.vstack([p_CQ[before], (front + fraction * (behind - front)).reshape(-1, 3)])


class HandView:
    """A camera that is fixed to the hand: its pose at given joints, and the part of its image that the hand covers.

    Silhouettes are kept once they are drawn. They depend on the opening of the jaws alone.

    Args:
        camera: calibrated camera with the tool frame as its world frame: its ``X_CW`` is X_CT.
        model: kinematics of the arm.
        shape: of the arm and its hand.
    """

    def __init__(self, camera: CameraModel, model: ArmModel, shape: ArmShape) -> None:
        self.camera = camera
        self._model, self._shape = model, shape
        self._silhouette = ArmSilhouette(camera, (0, 0, camera.width, camera.height), margin=_MARGIN)
        self._drawn: dict[int, np.ndarray] = {}

    @property
    def num_joints(self) -> int:
        """Number of the arm's joints."""
        return self._model.num_joints

    def at(self, q: np.ndarray) -> CameraModel:
        """Returns the camera in the world at joint positions q, shape (n,) [rad]."""
        X_TW = self._model.tool_pose(q).inverse().GetAsMatrix4()
        camera = self.camera
        return camera.in_frame(X_TW)

    def scene(self, jaw_width: float) -> np.ndarray:
        """Returns float32 (h, w), 1 where the image shows the scene and 0 where it shows the hand.

        Args:
            jaw_width: opening of the jaws [m].
        """
        step = round(jaw_width / _WIDTH_STEP)
        if step not in self._drawn:
            q = self._model.q_nominal
            X_TW = self._model.tool_pose(q).inverse().GetAsMatrix4()
            pieces = [p_WQ @ X_TW[:3, :3].T + X_TW[:3, 3] for p_WQ in self._shape.pieces(q, step * _WIDTH_STEP)]
            self._drawn[step] = (self._silhouette.mask(pieces) == 0).astype(np.float32)
        return self._drawn[step]
