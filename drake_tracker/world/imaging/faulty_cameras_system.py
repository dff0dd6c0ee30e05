"""Adds the cameras of a laboratory with two fixed cameras, with what goes wrong with their images."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydrake.systems.framework import DiagramBuilder

from drake_tracker.faults.fault import Fault, FaultyView
from drake_tracker.faults.image_faults_system import add_image_faults
from drake_tracker.world.config import CamerasConfig, LightingConfig, WristCamera
from drake_tracker.world.imaging.camera_system import Camera, CameraOptics, add_cameras
from drake_tracker.world.imaging.cameras import ImageWindow, true_camera_model
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA, hand_mount, wrist_optics


def add_faulty_cameras(
    builder: DiagramBuilder,
    *,
    laboratory: Any,
    tool_frame: str,
    config: CamerasConfig,
    lighting: LightingConfig,
    windows: Mapping[str, ImageWindow] | None = None,
    pipeline: ImagePipeline | None = None,
    faults: Sequence[Fault] = (),
    seed: int = 0,
) -> dict[str, Camera]:
    """Adds the fixed cameras, the camera on the hand if there is one, and the faults of their images.

    Args:
        builder: of the diagram that has the plant.
        laboratory: with the attributes ``plant``, ``gripper`` and ``scene_graph``, which is complete when there is a
            pipeline.
        tool_frame: frame of the hand on which its camera is mounted.
        config: where the cameras stand, their images and their noise.
        lighting: the lamps.
        windows: {camera name: window} to render; None renders the full images, and an empty one adds no cameras.
        pipeline: how late the images are, and which processes make them; None: they are rendered when they are read.
        faults: what goes wrong; of these, those of the images.
        seed: of the sensor noise.

    Returns {name: Camera}.
    """
    if windows is not None and not windows:
        return {}
    further: dict[str, CameraOptics] = {}
    if isinstance(config.wrist, WristCamera):
        parent, X_PT = hand_mount(laboratory.plant, laboratory.gripper, tool_frame)
        further[WRIST_CAMERA] = wrist_optics(config.wrist, lighting, parent=parent, X_PT=X_PT, seed=seed)
    cameras = add_cameras(
        builder,
        scene_graph=laboratory.scene_graph,
        config=config,
        lighting=lighting,
        windows=windows,
        pipeline=pipeline,
        seed=seed,
        further=further,
    )
    for name, camera in cameras.items():
        wrist = config.wrist if name == WRIST_CAMERA else None
        lens = wrist if isinstance(wrist, WristCamera) else config
        view = FaultyView(name.removeprefix("camera_"), true_camera_model(lens, camera.X_WC), camera.window)
        image_port = add_image_faults(
            builder,
            image_port=camera.image_port,
            view=view,
            faults=faults,
            latency=0 if pipeline is None else pipeline.latency,
            name=f"{name}_faults",
        )
        cameras[name] = replace(camera, image_port=image_port)
    return cameras
