"""The camera on the hand: its mounting and its lens."""

from typing import Any

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.world.config import LightingConfig, WristCamera
from drake_tracker.world.imaging.camera_system import CameraOptics
from drake_tracker.world.imaging.cameras import true_camera_model

WRIST = "wrist"
"""What the settings of faults call this camera."""
WRIST_CAMERA = "camera_wrist"
_CAMERA_INDEX = 2
"""Of the sensor noise, after those of the two fixed cameras."""
_NEAREST = 0.01
"""Distance from which on the renderer shows things [m]: the fingers are close."""


def wrist_camera_pose(config: WristCamera) -> RigidTransform:
    """Returns X_TC, the true pose of the camera in the frame of the tool. C follows OpenCV: x right, y down, z forward.

    The bottom of the image points towards the axis of the tool.

    Args:
        config: where the camera is mounted.
    """
    x, y, _ = config.offset
    distance = np.hypot(x, y)
    outward = np.array([x, y, 0.0]) / distance if distance > 0.0 else np.array([1.0, 0.0, 0.0])
    tilt = np.deg2rad(config.tilt_deg)
    forward = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) - np.sin(tilt) * outward
    right = np.array([-outward[1], outward[0], 0.0])
    return RigidTransform(RotationMatrix(np.column_stack([right, np.cross(forward, right), forward])), config.offset)


def describe_wrist(config: WristCamera) -> dict[str, Any]:
    """Returns {setting: value} of everything on which its calibration depends, as plain numbers and lists."""
    return {
        "width": config.width,
        "height": config.height,
        "fov_deg": float(config.fov_deg),
        "offset": [float(x) for x in config.offset],
        "tilt_deg": float(config.tilt_deg),
    }


def true_wrist_model(config: WristCamera) -> CameraModel:
    """Returns the `CameraModel` of the simulator itself, relative to the tool: its ``X_CW`` is X_CT."""
    return true_camera_model(config, wrist_camera_pose(config))


def wrist_optics(
    config: WristCamera, lighting: LightingConfig, *, parent: FrameId, X_PT: RigidTransform, seed: int
) -> CameraOptics:
    """Returns the optics of the camera.

    Args:
        config: where the camera is mounted, its lens and its noise.
        lighting: the flicker of the lamps.
        parent: frame that carries the camera.
        X_PT: pose of the tool in this frame.
        seed: of the sensor noise.
    """
    return CameraOptics(
        X_WC=X_PT @ wrist_camera_pose(config),
        parent=parent,
        nearest=_NEAREST,
        width=config.width,
        height=config.height,
        fov_deg=config.fov_deg,
        noise=config.noise,
        flicker=lighting.flicker,
        flicker_hz=lighting.flicker_hz,
        seed=seed,
        camera_index=_CAMERA_INDEX,
    )


def hand_mount(plant: MultibodyPlant, hand: ModelInstanceIndex, tool_frame: str) -> tuple[FrameId, RigidTransform]:
    """Returns the frame of the scene that moves with the hand, and the pose of the tool in it.

    Args:
        plant: finalized, with the hand.
        hand: model instance of the hand.
        tool_frame: name of the frame of the tool.
    """
    tool = plant.GetFrameByName(tool_frame, hand)
    return plant.GetBodyFrameIdOrThrow(tool.body().index()), tool.GetFixedPoseInBodyFrame()
