"""Finds the markers on the fingers of the robot's own hand in images, near the place that the joint angles predict.

A marker is a drum of three bands round a finger. On the left finger a white band lies between two black bands, on the
right finger a black band between two white bands. A camera sees the same bands from every side. The image is compared
with the shape of the bands only: the mean of the pixels that must be white minus the mean of the pixels that must be
black. The light changes this contrast, but hardly the place where it is largest.

The search is for one displacement of both markers from their predicted places. Since the two have opposite bands, a
marker at the place of the other one counts against it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.subpixel_peak import peak_offset

RADIUS = 0.014
"""Radius of the drums [m], as in ``models/gripper/gripper_marked.sdf``."""
HALF_MIDDLE = 0.009
"""Half the height of the middle band [m]."""
HALF_HEIGHT = 0.018
"""Half the height of a drum [m]."""
SIGNS = (1.0, -1.0)
"""1 where the middle band is white, -1 where it is black, for the left and the right finger."""
_FINE = 4
"""Points along each side of a pixel at which the template is evaluated."""
_MARGIN = 2
"""Pixels of the template around the drum."""
_SECOND_BEST = 0.7
"""Largest response elsewhere, relative to the best one, at which the best one is not ambiguous."""
_OWN_SHARE = 0.5
"""A marker counts as seen when its own response is at least this share of the larger one of the two."""
NEWEST = 9
"""Number of the newest measurements whose median counts; as many are needed before the first displacement."""


@dataclass(frozen=True)
class MarkerSearch:
    """Where markers are searched for, and which responses are accepted.

    Attributes:
        reach: largest displacement from the predicted place in each direction of the image [m] at the marker.
        least_contrast: least difference between white and black bands [grey levels].
        least_correlation: least correlation of the image with the bands.
        max_gap: largest distance between the two rays [m].
    """

    reach: float = 0.04
    least_contrast: float = 25.0
    least_correlation: float = 0.7
    max_gap: float = 0.03


class _Response(NamedTuple):
    """How well one marker agrees with the image for each displacement.

    Attributes:
        contrast: between the pixels that must be white and black, shape (n, n) [grey levels].
        patch: the part of the image around the predicted place.
        template: of the marker.
    """

    contrast: np.ndarray
    patch: np.ndarray
    template: np.ndarray

    def correlation(self, row: int, column: int) -> float:
        """Returns the correlation of the image with the bands at one displacement, an element of ``contrast``."""
        size = len(self.template)
        bands = self.template != 0.0
        image = self.patch[row : row + size, column : column + size][bands]
        return float(np.corrcoef(image, self.template[bands])[0, 1]) if image.std() > 0.0 else 0.0


class FoundMarkers(NamedTuple):
    """The markers of the hand in one image.

    Attributes:
        uv: where the mean of the centres of the markers seen appears, shape (2,) [px, full image].
        predicted: where it is predicted to appear, shape (2,) [px, full image].
        contrast: between their white and black bands [grey levels].
        markers: number of markers seen, 1 or 2.
    """

    uv: np.ndarray
    predicted: np.ndarray
    contrast: float
    markers: int


class HandPointFound(NamedTuple):
    """The tool point as two cameras see it.

    Attributes:
        p_WT: its position in W, displaced as an object below it, shape (3,) [m].
        gap: distance between the two rays [m].
        markers: number of markers seen in both images together, 2 to 4.
    """

    p_WT: np.ndarray
    gap: float
    markers: int


def marker_template(scale: float, up: np.ndarray, sine: float) -> np.ndarray:
    """Returns the template of a drum with a white middle band, float32 of shape (n, n) with n odd.

    Its white pixels sum up to 1 and its black ones to -1. The projected centre of the drum is at the middle pixel.

    Args:
        scale: of the image at the marker [px/m].
        up: unit vector of the drum's axis in the image (right, down), shape (2,).
        sine: sine of the angle by which the camera looks down on the drum.
    """
    cosine = np.sqrt(1.0 - sine * sine)
    half = int(np.ceil(scale * np.hypot(RADIUS, HALF_HEIGHT * cosine + RADIUS * abs(sine)))) + _MARGIN
    size = 2 * half + 1
    fine = (np.arange(size * _FINE) + 0.5) / _FINE - 0.5 - half
    right, down = np.meshgrid(fine / scale, fine / scale)
    across = right * -up[1] + down * up[0]
    along = right * up[0] + down * up[1]
    nearer = np.sqrt(np.maximum(RADIUS * RADIUS - across * across, 0.0))  # from the axis to the surface
    height = np.abs(along + nearer * sine) / cosine
    sign = np.where(height < HALF_MIDDLE, 1.0, np.where(height < HALF_HEIGHT, -1.0, 0.0))
    sign[np.abs(across) > RADIUS] = 0.0
    template = sign.reshape(size, _FINE, size, _FINE).mean(axis=(1, 3))
    white, black = np.maximum(template, 0.0), np.maximum(-template, 0.0)
    return (white / white.sum() - black / black.sum()).astype(np.float32)


class HandMarkerFinder:
    """Searches one camera's image for the markers.

    Args:
        camera: calibrated camera.
        window: the part of the full image that is searched, (u0, v0, width, height) [px].
        search: where to search, and what to accept.
    """

    def __init__(
        self, camera: CameraModel, window: tuple[int, int, int, int], search: MarkerSearch = MarkerSearch()
    ) -> None:
        self.camera = camera
        self._first = np.array(window[:2], float)
        self._size = np.array(window[2:], float)
        self._search = search

    def find(self, grey: np.ndarray, p_WM: np.ndarray, up_W: np.ndarray) -> FoundMarkers | None:
        """Returns the markers in an image, or None when they are not found beyond doubt.

        Args:
            grey: the window of the image, uint8 of shape (height, width).
            p_WM: predicted centres of the markers, shape (2, 3) [m].
            up_W: unit vectors along the axes of their drums, shape (2, 3).
        """
        uv = self.camera.project(p_WM) - self._first
        if not np.isfinite(uv).all():
            return None
        tips = self.camera.project(p_WM + 0.01 * up_W) - self._first
        rays = p_WM - self.camera.X_WC[:3, 3]
        scale = self.camera.K[0, 0] / (rays @ self.camera.X_CW[2, :3])
        reach = int(np.ceil(self._search.reach * scale.max()))
        responses: dict[int, _Response] = {}
        for k, sign in enumerate(SIGNS):
            up = (tips[k] - uv[k]) / np.linalg.norm(tips[k] - uv[k])
            sine = float(-rays[k] @ up_W[k] / np.linalg.norm(rays[k]))
            template = sign * marker_template(scale[k], up, sine)
            half = len(template) // 2
            if ((uv[k] < half) | (uv[k] > self._size - 1 - half)).any():
                continue
            side = 2 * (reach + half) + 1
            patch = cv2.getRectSubPix(grey, (side, side), uv[k].tolist(), patchType=cv2.CV_32F)
            contrast = cv2.matchTemplate(patch, template, cv2.TM_CCORR)
            responses[k] = _Response(contrast, patch, template)
        return self._best(responses, uv, p_WM, RADIUS * float(scale.min())) if responses else None

    def _best(
        self, responses: Mapping[int, _Response], uv: np.ndarray, p_WM: np.ndarray, radius: float
    ) -> FoundMarkers | None:
        """Returns the markers at the displacement with the largest response.

        Args:
            responses: {marker: its response}, without markers outside of the window.
            uv: predicted pixels of the markers in the window, shape (2, 2).
            p_WM: predicted centres of the markers, shape (2, 3) [m].
            radius: of a drum [px]; responses farther away than its double belong to something else.
        """
        both = np.sum([response.contrast for response in responses.values()], axis=0)
        row, column = divmod(int(both.argmax()), both.shape[1])
        largest = both[row, column]
        own = {k: float(response.contrast[row, column]) for k, response in responses.items()}
        least = max(self._search.least_contrast, _OWN_SHARE * max(own.values()))
        seen = [k for k, value in own.items() if value >= least]
        alike = [responses[k].correlation(row, column) for k in seen]
        if not seen or max(alike) < self._search.least_correlation:
            return None
        rows, columns = np.ogrid[: both.shape[0], : both.shape[1]]
        elsewhere = (rows - row) ** 2 + (columns - column) ** 2 > (2.0 * radius) ** 2
        if elsewhere.any() and both[elsewhere].max() > _SECOND_BEST * largest:
            return None
        response = np.sum([responses[k].contrast for k in seen], axis=0)
        peak = _refined(response, row, column)
        if peak is None:
            return None
        centre = 0.5 * (np.array(response.shape[::-1]) - 1.0)
        found = uv[seen].mean(axis=0) + peak - centre + self._first
        contrast = sum(own[k] for k in seen) / len(seen)
        return FoundMarkers(found, self.camera.project(p_WM[seen].mean(axis=0))[0], contrast, len(seen))


def _refined(response: np.ndarray, row: int, column: int) -> np.ndarray | None:
    """Returns the maximum next to a place in a map as (column, row), from parabolas; None at the edge of the map."""
    height, width = response.shape
    for _ in range(3):  # the maximum of one marker may lie beside that of both
        if not (0 < row < height - 1 and 0 < column < width - 1):
            return None
        area = response[row - 1 : row + 2, column - 1 : column + 2]
        down, right = divmod(int(area.argmax()), 3)
        if (down, right) == (1, 1):
            break
        row, column = row + down - 1, column + right - 1
    else:
        return None
    return np.array([column + peak_offset(area[1], 1), row + peak_offset(area[:, 1], 1)])


def triangulate_hand(
    cameras: Sequence[CameraModel],
    found: Sequence[FoundMarkers | None],
    p_WT: np.ndarray,
    height: float,
    max_gap: float,
) -> HandPointFound | None:
    """Returns the tool point by two cameras, or None when a camera does not see it, or when the cameras disagree.

    A wrong calibration displaces all pixels of an image almost alike, but a point in space by an amount that depends on
    its height, since rays to a high point are flatter. The displacements of the markers in the images are therefore
    applied to the point below the tool at the height of the objects. The tool is displaced by as much as this point.

    Args:
        cameras: the left and the right camera, calibrated.
        found: what each of them sees.
        p_WT: the predicted tool point, shape (3,) [m].
        height: z_W of the objects whose positions are to be corrected [m].
        max_gap: largest distance between the two rays [m].
    """
    left, right = found
    if left is None or right is None:
        return None
    below = np.array([p_WT[0], p_WT[1], height])
    pixels = []
    for camera, view in zip(cameras, (left, right)):
        pixels.append(camera.project(below)[0] + view.uv - view.predicted)
    meeting = triangulate(cameras[0], cameras[1], pixels[0], pixels[1])
    if meeting is None or meeting.gap > max_gap:
        return None
    return HandPointFound(p_WT + meeting.p_WQ - below, meeting.gap, left.markers + right.markers)


@dataclass(frozen=True, eq=False)
class HandDisplacement(FrozenState):
    """What the images of one camera have shown so far.

    Attributes:
        measured: the newest displacements to the right and downwards, oldest first, each of shape (2,) [px].
        missed: number of images since the newest one.
    """

    measured: tuple[np.ndarray, ...] = ()
    missed: int = 0

    @property
    def median(self) -> np.ndarray:
        """Displacement to the right and downwards, shape (2,) [px]; zeros while it is not known."""
        return np.median(self.measured, axis=0) if len(self.measured) == NEWEST else np.zeros(2)


def with_image(state: HandDisplacement, found: FoundMarkers | None, kept_images: int) -> HandDisplacement:
    """Returns the state after another image.

    Args:
        state: the state before.
        found: the markers in the image, None if they were not found.
        kept_images: number of images in a row without markers after which the displacement is forgotten.
    """
    if found is not None:
        return HandDisplacement((*state.measured[-NEWEST + 1 :], read_only(found.uv - found.predicted)))
    missed = state.missed + 1
    return HandDisplacement() if missed > kept_images else HandDisplacement(state.measured, missed)
