"""Adds the cameras of a laboratory with two fixed cameras, with the faults of their images."""

from dataclasses import replace
from typing import Any

from pydrake.systems.framework import DiagramBuilder

from drake_tracker.faults.fault import FaultyView
from drake_tracker.faults.image_faults_system import add_image_faults
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.config import CamerasConfig, WristCamera
from drake_tracker.world.imaging.camera_system import Camera, CameraOptics, add_cameras
from drake_tracker.world.imaging.cameras import true_camera_model
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA, hand_mount, wrist_optics


def add_faulty_cameras(
    builder: DiagramBuilder, *, laboratory: Any, config: WorldConfig, cameras: CamerasConfig
) -> dict[str, Camera]:
    """Adds the fixed cameras, the camera on the hand if there is one, and the faults of their images.

    Args:
        builder: of the diagram that has the plant.
        laboratory: with the attributes ``plant``, ``gripper`` and ``scene_graph``, which is complete when there is a
            pipeline.
        config: of the laboratory.
        cameras: where the cameras stand, their images and their noise.

    Returns {name: Camera}.
    """
    if config.windows is not None and not config.windows:
        return {}
    further: dict[str, CameraOptics] = {}
    if isinstance(cameras.wrist, WristCamera):
        parent, X_PT = hand_mount(laboratory.plant, laboratory.gripper, config.arm.tool_frame)
        further[WRIST_CAMERA] = wrist_optics(cameras.wrist, config.lighting, parent=parent, X_PT=X_PT, seed=config.seed)
    added = add_cameras(
        builder,
        scene_graph=laboratory.scene_graph,
        config=cameras,
        lighting=config.lighting,
        windows=config.windows,
        pipeline=config.pipeline,
        seed=config.seed,
        further=further,
    )
    for name, camera in added.items():
        wrist = cameras.wrist if name == WRIST_CAMERA else None
        lens = wrist if isinstance(wrist, WristCamera) else cameras
        added[name] = with_image_faults(builder, name, camera, lens, config)
    return added


def with_image_faults(
    builder: DiagramBuilder, name: str, camera: Camera, lens: Any, config: WorldConfig, view: str = ""
) -> Camera:
    """Adds the faults of the images of a camera, and returns the camera with them.

    Args:
        builder: of the diagram that has the camera.
        name: of the camera.
        camera: the camera.
        lens: its settings.
        config: of the laboratory.
        view: what faults call the camera; empty: its name without ``camera_``.
    """
    image_port = add_image_faults(
        builder,
        image_port=camera.image_port,
        view=FaultyView(view or name.removeprefix("camera_"), true_camera_model(lens, camera.X_WC), camera.window),
        faults=config.faults,
        latency=config.image_latency,
        name=f"{name}_faults",
    )
    return replace(camera, image_port=image_port)
