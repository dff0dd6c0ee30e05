"""From the regions of two images to points of objects, and from tracks to windows in the images."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.vision.region_of_interest import check_box
from drake_tracker.vision.silhouettes.object_shape import outline_area
from drake_tracker.vision.silhouettes.regions import Region
from drake_tracker.vision.silhouettes.track_3d import Measurement, Track3D
from drake_tracker.vision.silhouettes.validation_gate import UNCONFIRMED, ValidationGate

GATE = 16.0
"""Squared Mahalanobis distance up to which a region may belong to a track: 99.97 % in two dimensions."""
WIDEST_GATE = 12.0
"""Largest standard deviation of an expected centroid [px]."""
_STEP = 1e-5
"""Step of a numerical derivative, as a fraction of the distance from the camera."""


class StereoGeometry:
    """Two calibrated cameras, and the volume in which they look for objects.

    Args:
        cameras: the left and the right camera, calibrated.
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts objects anywhere.
        margin: by which an object may lie outside the work volume [m].
        max_gap: largest distance between the two rays of one object [m].

    Attributes:
        cameras: the left and the right camera.
        middle_height: z_W of the middle of the work volume [m], or None.

    Raises DrakeTrackerError when the work volume is not a box.
    """

    def __init__(
        self, cameras: Sequence[CameraModel], *, work_volume: ArrayLike | None, margin: float, max_gap: float
    ) -> None:
        self.cameras = (cameras[0], cameras[1])
        self._max_gap = max_gap
        self._box: tuple[list[float], list[float]] | None = None
        self.middle_height: float | None = None
        if work_volume is not None:
            lower, upper = check_box(work_volume)
            self._box = ((lower - margin).tolist(), (upper + margin).tolist())
            self.middle_height = 0.5 * float(lower[2] + upper[2])

    def measure(self, left: Region, right: Region) -> Measurement | None:
        """Returns the triangulated point of two regions, or None when their rays do not meet within ``max_gap``."""
        meeting = triangulate(*self.cameras, (left.u, left.v), (right.u, right.v))
        if meeting is None or meeting.gap > self._max_gap:
            return None
        information = np.zeros((3, 3))
        for camera, region in zip(self.cameras, (left, right)):
            J = projection_jacobian(camera, meeting.p_WQ)
            information += (J.T / (region.var_u, region.var_v)) @ J
        return Measurement(meeting.p_WQ, np.linalg.inv(information), meeting.gap, min(left.share, right.share))

    def offsets(self, p_WQ: np.ndarray, displacements: Sequence[np.ndarray]) -> np.ndarray:
        """Returns by how much a point appears beside where the cameras project it, shape (2, 2) [px], left and right.

        If the calibration is wrong, the rays to one point do not meet. These are the differences between its pixels and
        the pixels of the triangulated point.

        Args:
            p_WQ: a point near it, shape (3,) [m].
            displacements: of the left and the right image by the error of the calibration, shape (2,) [px] each.
        """
        if not np.any(displacements):
            return np.zeros((2, 2))
        seen = [camera.project(p_WQ)[0] + each for camera, each in zip(self.cameras, displacements)]
        meeting = triangulate(*self.cameras, *seen)
        if meeting is None:
            return np.zeros((2, 2))
        return np.array(seen) - [camera.project(meeting.p_WQ)[0] for camera in self.cameras]

    def measure_at_height(
        self, track: Track3D, regions: Sequence[Region | None], offsets: np.ndarray
    ) -> Measurement | None:
        """Returns the point that agrees best with the regions of an object whose height is known or predicted.

        Where the silhouettes of two objects are merged in one image, the other image and the height still determine the
        point.

        Args:
            track: of the object, at the stamp of the images.
            regions: the region in the left and in the right image, None where there is none.
            offsets: as from `offsets`, shape (2, 2) [px].

        Returns None when the regions contradict each other.
        """
        height, height_std = track.expected_height, track.expected_height_std
        p_WQ = np.array([track.position[0], track.position[1], height])
        views = [
            (camera, region, (region.u, region.v) - offset)
            for camera, region, offset in zip(self.cameras, regions, offsets)
            if region is not None
        ]
        for _ in range(2):
            information, vector = np.diag([0.0, 0.0, height_std**-2]), np.zeros(3)
            vector[2] = (height - p_WQ[2]) / height_std**2
            for camera, region, uv in views:
                J = projection_jacobian(camera, p_WQ)
                weighted = J.T / (region.var_u, region.var_v)
                information += weighted @ J
                vector += weighted @ (uv - camera.project(p_WQ)[0])
            p_WQ = p_WQ + np.linalg.solve(information, vector)
        for camera, region, uv in views:
            residual = uv - camera.project(p_WQ)[0]
            if not residual @ (residual / (region.var_u, region.var_v)) <= GATE:
                return None
        share = min(region.share for _, region, _ in views)
        return Measurement(p_WQ, np.linalg.inv(information), 0.0, share, height_std**-2 if track.height_free else 0.0)

    def windows(
        self, tracks: Sequence[Track3D], side: int, offsets: Sequence[np.ndarray] | None = None
    ) -> list[ValidationGate]:
        """Returns the windows of all tracks in one image; a track behind the camera has none that can be reached.

        Args:
            tracks: the tracks.
            side: 0 for the left image, 1 for the right one.
            offsets: of each track, as from `offsets`, shape (2, 2) [px]; None for zeros.
        """
        if not tracks:
            return []
        camera = self.cameras[side]
        places = camera.project([track.position for track in tracks])
        views = (places if offsets is None else places + [each[side] for each in offsets]).tolist()
        windows = []
        for track, (u, v) in zip(tracks, views):
            J = projection_jacobian(camera, track.position)
            S = J @ track.covariance[:3, :3] @ J.T
            std = min(math.sqrt(0.5 * (S[0, 0] + S[1, 1])), WIDEST_GATE)
            if not (math.isfinite(u) and math.isfinite(v) and math.isfinite(std)):
                u, v, std, J = -1e6, -1e6, 0.0, np.zeros((2, 3))
            edges = J @ track.shape.edges
            pixels = track.shape.fill * outline_area(edges)
            depth = math.dist(track.position, camera.X_WC[:3, 3])
            number, shape = track.number or UNCONFIRMED, track.shape
            windows.append(ValidationGate(number, u, v, std, edges, pixels, depth, J, shape.settled, shape.sized))
        return windows

    def contains(self, p_WQ: np.ndarray) -> bool:
        """Returns whether a point lies in the work volume, shape (3,) [m]."""
        if self._box is None:
            return True
        return all(low <= x <= high for low, x, high in zip(self._box[0], p_WQ.tolist(), self._box[1]))

    def height_error(self, p_WQ: np.ndarray) -> float:
        """Returns the vertical distance of a point from the middle of the work volume [m]."""
        return 0.0 if self.middle_height is None else abs(float(p_WQ[2]) - self.middle_height)


def projection_jacobian(camera: CameraModel, p_WQ: np.ndarray) -> np.ndarray:
    """Returns the derivative of the pixel (u, v) by the position p_WQ, shape (2, 3) [px/m].

    The distortion of a pinhole with five coefficients is ignored; the distortion of wider lenses is not.
    """
    if camera.is_wide:
        step = _STEP * float(np.linalg.norm(p_WQ - camera.X_WC[:3, 3]))
        uv = camera.project(p_WQ + step * np.vstack([np.eye(3), -np.eye(3)]))
        return (uv[:3] - uv[3:]).T / (2.0 * step)
    R_CW, (fx, fy) = camera.X_CW[:3, :3], camera.focal_lengths
    x, y, z = R_CW @ p_WQ + camera.X_CW[:3, 3]
    return np.array([[fx / z, 0.0, -fx * x / z**2], [0.0, fy / z, -fy * y / z**2]]) @ R_CW
