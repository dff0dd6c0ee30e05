"""The geometry of the simulated cameras: their poses, their lenses, and the rendered part of their images.

`CameraInfo` and the pixel coordinates of this project differ by half a pixel; the rule is in
`cameras.camera_model.opencv_intrinsics`.
"""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo

from drake_tracker.cameras.camera_model import CameraModel, opencv_intrinsics
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import CamerasConfig

CAMERA_NAMES = ("camera_left", "camera_right")

ImageWindow = tuple[int, int, int, int]
"""Part of an image: (u0, v0, width, height) [px]."""


class ImageSize(Protocol):
    """The settings that determine a lens; `CamerasConfig` and `BoardCameraConfig` have them.

    Attributes:
        width: width of the full image [px].
        height: height of the full image [px].
        fov_deg: vertical field of view.
    """

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def fov_deg(self) -> float: ...


def camera_pose(
    azimuth_deg: float, elevation_deg: float, distance: float, look_at: Sequence[float] | np.ndarray
) -> RigidTransform:
    """Returns X_WC of a camera that looks at a point. C follows OpenCV: x right, y down, z forward.

    Args:
        azimuth_deg: direction of the camera from the point, about W's z axis, counted from W's x axis.
        elevation_deg: direction of the camera from the point, above the horizontal.
        distance: from the point [m].
        look_at: the point (3,) [m, W].

    Raises DrakeTrackerError when the camera would look straight up or down, where its roll is undefined, or when the
    distance is not positive.
    """
    if not abs(elevation_deg) < 89.0:
        raise DrakeTrackerError(f"cameras.elevation_deg is {elevation_deg:g}; it must lie between -89 and 89")
    if not distance > 0.0:
        raise DrakeTrackerError(f"cameras.distance is {distance:g} m; it must be positive")
    azimuth, elevation = np.deg2rad([azimuth_deg, elevation_deg])
    towards_camera = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    forward = -towards_camera
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    R_WC = RotationMatrix(np.column_stack([right, np.cross(forward, right), forward]))
    return RigidTransform(R_WC, np.asarray(look_at, dtype=float) + distance * towards_camera)


def camera_poses(config: CamerasConfig) -> dict[str, RigidTransform]:
    """Returns {name: X_WC} of the two cameras of the train."""
    return {
        name: camera_pose(azimuth_deg, config.elevation_deg, config.distance, config.look_at)
        for name, azimuth_deg in zip(CAMERA_NAMES, config.azimuth_deg, strict=True)
    }


def describe_rig(config: CamerasConfig) -> dict[str, Any]:
    """Returns {setting: value} of everything on which a calibration depends, as plain numbers and lists."""
    return {
        "width": config.width,
        "height": config.height,
        "fov_deg": float(config.fov_deg),
        "distance": float(config.distance),
        "azimuth_deg": [float(angle) for angle in config.azimuth_deg],
        "elevation_deg": float(config.elevation_deg),
        "look_at": [float(x) for x in config.look_at],
    }


def focal_length(height: int, fov_deg: float) -> float:
    """Returns the focal length [px] of an image.

    Args:
        height: of the image [px].
        fov_deg: vertical field of view.
    """
    return 0.5 * height / np.tan(0.5 * np.deg2rad(fov_deg))


def camera_info(
    width: int, height: int, fov_deg: float, window: ImageWindow | None = None, factor: int = 1
) -> CameraInfo:
    """Returns the `CameraInfo` that renders an image or a window of it.

    A window shows the same pixels as the full image, except for rounding in the renderer at a few in ten thousand.

    Args:
        width: of the full image [px].
        height: of the full image [px].
        fov_deg: vertical field of view of the full image.
        window: part of the image to render, a `renderable_window`; None renders all of it.
        factor: rendered pixels per image pixel, along u and along v.
    """
    u0, v0, window_width, window_height = window or (0, 0, width, height)
    f = focal_length(height, fov_deg)
    numbers = (f, f, 0.5 * width - u0, 0.5 * height - v0)
    return CameraInfo(factor * window_width, factor * window_height, *(factor * number for number in numbers))


def lens_matrix(config: ImageSize) -> np.ndarray:
    """Returns the intrinsic matrix (3, 3) [px] of a simulated camera."""
    return opencv_intrinsics(camera_info(config.width, config.height, config.fov_deg))


def true_camera_models(config: CamerasConfig) -> dict[str, CameraModel]:
    """Returns {name: CameraModel} of the simulator itself: the ground truth for judging a calibration."""
    return {name: true_camera_model(config, X_WC) for name, X_WC in camera_poses(config).items()}


def true_camera_model(config: ImageSize, X_WC: RigidTransform) -> CameraModel:
    """Returns the `CameraModel` of the simulator itself for a camera at X_WC."""
    return CameraModel.from_camera_info(camera_info(config.width, config.height, config.fov_deg), X_WC)


def renderable_window(window: Sequence[float], width: int, height: int) -> ImageWindow:
    """Returns the smallest window that contains a given one and that Drake can render.

    The result is clipped to the full image, and contains its centre, because `CameraInfo` refuses a principal point
    outside the image.

    Args:
        window: (u0, v0, width, height) [px].
        width: of the full image [px].
        height: of the full image [px].

    Raises DrakeTrackerError when the window is empty or outside the image.
    """
    u0, v0, window_width, window_height = (int(x) for x in window)
    u1, v1 = min(u0 + window_width, width), min(v0 + window_height, height)
    u0, v0 = max(u0, 0), max(v0, 0)
    if u1 <= u0 or v1 <= v0:
        raise DrakeTrackerError(f"render window {tuple(window)} does not overlap the image of {width} x {height} px")
    # Strictly inside: one more pixel on the far side when the centre falls on the window's edge.
    u0, u1 = min(u0, (width - 1) // 2), max(u1, width // 2 + 1)
    v0, v1 = min(v0, (height - 1) // 2), max(v1, height // 2 + 1)
    return u0, v0, u1 - u0, v1 - v0
