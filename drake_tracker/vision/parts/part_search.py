"""Finds new parts on a belt: the common regions of the silhouettes of all cameras, and the parts that could cover these
regions.

Seen on a horizontal plane at half the height of the parts, a silhouette is the footprint of the part, extended towards
and away from its camera. The common region of the silhouettes of all cameras is little more than the footprint. Each
common region is covered by as few parts as possible: first the part that covers most of the region, then further parts
in the remainder.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.vision.parts.part_silhouette import PartPose, piece_corners

CELL = 0.004
"""Side of a cell of the plane [m]."""
YAW_STEP = math.radians(10.0)
"""Step of the directions that are tried."""
PLANE = 0.013
"""Height of the plane above the belt, half of the height of a part [m]."""
LEAST_SHARE = 0.5
"""Share of the smallest part that a region, or its remainder, must cover to show a part."""
MOST_PARTS = 5
"""Number of touching parts that are told apart."""
OUTSIDE, TAKEN, BESIDE = 1.0, 1.0, 1.5
"""Penalties of a place of a part, relative to the covered area: empty area, area that another part covers already, and
area of the region beside the part. The last one finds the outermost part first."""
_BESIDE, _ERASED = np.ones((3, 3), np.uint8), np.ones((3, 3), np.uint8)


class PartCandidate(NamedTuple):
    """A candidate part.

    Attributes:
        poses: {kind: where a part of this kind would lie}.
        kind: which of them covers most.
    """

    poses: Mapping[PartKind, PartPose]
    kind: PartKind


class PartSearch:
    """Finds parts that no track explains. It has no state.

    Args:
        cameras: calibrated cameras.
        windows: part of the full image that each one's images show, (u0, v0, width, height) [px].
        belt_height: z_W of the belt's upper face [m].
        view: lowest and highest corner (x, y) in W of the belt that is searched, shape (2, 2) [m].
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        windows: Sequence[tuple[int, int, int, int]],
        belt_height: float,
        view: np.ndarray,
    ) -> None:
        self._low = np.asarray(view[0], dtype=float)
        self._height = belt_height + PLANE
        self._belt_height = belt_height
        self._eyes = [camera.X_WC[:3, 3] for camera in cameras]
        columns, rows = (math.ceil(extent / CELL) + 1 for extent in np.asarray(view[1]) - self._low)
        x, y = np.meshgrid(self._low[0] + CELL * np.arange(columns), self._low[1] + CELL * np.arange(rows))
        points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, self._height)])
        self._maps = [
            (camera.project(points) - window[:2]).astype(np.float32).reshape(rows, columns, 2)
            for camera, window in zip(cameras, windows)
        ]

    def candidates(self, masks: Sequence[np.ndarray], unseen: Sequence[np.ndarray]) -> list[PartCandidate]:
        """Returns candidate parts. Candidates whose outlines touch are returned in sequence.

        Args:
            masks: the foreground of each camera's image that belongs to no track, uint8 (h, w), 255 there.
            unseen: the part of the belt that each image does not show, uint8 (h, w), 255 there. A part at such a place
                is truncated.
        """
        common = self._common(masks)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(common, connectivity=8)
        least = LEAST_SHARE * min(_area(kind) for kind in PART_SHAPES)
        large = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] * CELL**2 >= least]
        if not large:
            return []
        hidden = cv2.bitwise_or(*(self._plane(each, m, 255) for each, m in zip(unseen, self._maps)))
        hidden = cv2.dilate(cv2.threshold(hidden, 0, 1, cv2.THRESH_BINARY)[1], _BESIDE)
        found: list[PartCandidate] = []
        for k in large:
            region = np.where(labels == k, np.uint8(1), np.uint8(0))
            found += self._covering(region, hidden, stats[k, :4], least)
        return found

    def _common(self, masks: Sequence[np.ndarray]) -> np.ndarray:
        return cv2.bitwise_and(*(self._plane(each, m, 0) for each, m in zip(masks, self._maps)))

    @staticmethod
    def _plane(image: np.ndarray, places: np.ndarray, outside: int) -> np.ndarray:
        """Returns an image as the plane would look, uint8 (rows, columns)."""
        return cv2.remap(image, places, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)

    def _covering(self, region: np.ndarray, hidden: np.ndarray, box: np.ndarray, least: float) -> list[PartCandidate]:
        """Returns the parts that cover a region.

        Args:
            region: uint8 (rows, columns), 1 on it.
            hidden: uint8 (rows, columns), 1 beside what is not seen: a part there is not whole.
            box: first column and row of the region, its width and height.
            least: smallest area that shows a part [m^2].
        """
        column, row, width, height = box.tolist()
        x, y = (self._low + CELL * np.array([column + 0.5 * width, row + 0.5 * height])).tolist()
        templates = [(kind, yaw, self._template(kind, x, y, yaw)) for kind, turns in _TURNS.items() for yaw in turns]
        margin = max(max(template.shape) for *_, template in templates)
        near = slice(row, row + height + 2 * margin), slice(column, column + width + 2 * margin)
        left = cv2.copyMakeBorder(region, *(margin,) * 4, cv2.BORDER_CONSTANT)[near].astype(np.float32)
        cut = cv2.copyMakeBorder(hidden, *(margin,) * 4, cv2.BORDER_CONSTANT, value=1)[near]
        whole = left.copy()
        found: list[PartCandidate] = []
        while left.sum() * CELL**2 >= least and len(found) < MOST_PARTS:
            best: dict[PartKind, tuple[float, float, tuple[int, int], np.ndarray]] = {}
            worth = left - OUTSIDE * (1.0 - whole) - TAKEN * (whole - left)
            for kind, yaw, template in templates:
                ring = cv2.dilate(template, _BESIDE) - template
                scores = cv2.matchTemplate(worth, template, cv2.TM_CCORR)
                scores -= BESIDE * cv2.matchTemplate(left, ring, cv2.TM_CCORR)
                _, score, _, place = cv2.minMaxLoc(scores)
                if kind not in best or score > best[kind][0]:
                    best[kind] = score, yaw, place, template
            kind = max(best, key=lambda each: best[each][0])
            score, _, (u, v), template = best[kind]
            if score * CELL**2 < least:
                break
            poses = {}
            for each, (_, yaw, (i, j), shape) in best.items():
                place = self._low + CELL * (
                    np.array([column + i, row + j]) - margin + 0.5 * (np.array(shape.shape)[::-1] - 1)
                )
                poses[each] = PartPose(each, float(place[0]), float(place[1]), yaw)
            around = slice(v, v + template.shape[0]), slice(u, u + template.shape[1])
            if not (cut[around] * template).any():
                found.append(PartCandidate(poses, kind))
            covered = cv2.dilate(template, _ERASED)
            left[around][covered > 0] = 0.0
        return found

    def _template(self, kind: PartKind, x: float, y: float, yaw: float) -> np.ndarray:
        """Returns the region that a part at a place would make, float32 of odd size, its origin of P in the middle."""
        c, s = math.cos(yaw), math.sin(yaw)
        half = math.ceil((PART_SHAPES[kind].radius + 2.0 * PLANE) / CELL)
        common = None
        for eye in self._eyes:
            seen = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
            for corners in piece_corners(kind):
                p_WQ = corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + (x, y, self._belt_height)
                share = (self._height - eye[2]) / (p_WQ[:, 2:] - eye[2])
                places = (eye[:2] + share * (p_WQ[:, :2] - eye[:2]) - (x, y)) / CELL + half
                hull = cv2.convexHull(places.astype(np.float32))
                cv2.fillConvexPoly(seen, np.rint(16.0 * hull).astype(np.int32), 1, lineType=cv2.LINE_8, shift=4)
            common = seen if common is None else cv2.bitwise_and(common, seen)
        assert common is not None
        return common.astype(np.float32)


def _turns(kind: PartKind) -> list[float]:
    turns = PART_SHAPES[kind].turns
    return np.arange(0.0, 2.0 * math.pi / turns - 1e-9, YAW_STEP).tolist() if turns else [0.0]


def _area(kind: PartKind) -> float:
    """Returns the area of a part seen from above [m^2]."""
    return sum(float(cv2.contourArea(each[:, :2].astype(np.float32)[: len(each) // 2])) for each in piece_corners(kind))


_TURNS = {kind: _turns(kind) for kind in PART_SHAPES}
