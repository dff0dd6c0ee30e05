"""Adds simulated cameras to a diagram: Drake's `RgbdSensor` or a `PipelinedCamera`, each with a realistic sensor."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.sensors import RgbdSensor

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.imaging.cameras import ImageWindow, camera_info, camera_poses, renderable_window
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.imaging.lighting import render_engine_params
from drake_tracker.world.imaging.pipelined_camera_system import CameraMount, PipelinedCamera, add_pipelined_camera
from drake_tracker.world.imaging.sensor_model import SensorModel, SensorNoise
from drake_tracker.world.imaging.sensor_noise_system import PixelBinningSystem, SensorNoiseSystem

RENDERER_NAME = "cameras"
_FARTHEST = 10.0
"""Distance up to which the renderer shows things [m]."""
_DEPTH_RANGE = DepthRange(0.1, 9.9)


@dataclass(frozen=True)
class Camera:
    """One camera of a diagram.

    Attributes:
        sensor: the System that makes its images: an `RgbdSensor`, or a `PipelinedCamera` that it may share.
        sensor_port: output port of that System.
        image_port: the colour image with noise and flicker, an `ImageRgba8U` of the window.
        window: part of the full frame that is rendered: pixel (0, 0) of the image is pixel (u0, v0) of the full frame.
        X_WC: pose of the OpenCV camera frame, or pose in the frame that carries it: ground truth, for judges and
            pictures only.
        model: from the rendered image to the camera's image.
    """

    sensor: System
    sensor_port: OutputPort
    image_port: OutputPort
    window: ImageWindow
    X_WC: RigidTransform
    model: SensorModel


@dataclass(frozen=True)
class CameraOptics:
    """The lens and the sensor of a camera.

    Attributes:
        X_WC: pose of the OpenCV camera frame: x right, y down, z forward. With a ``parent``, in that frame.
        width: of the full image [px].
        height: of the full image [px].
        fov_deg: vertical field of view of the full image.
        window: part of the image to render; None renders all of it.
        supersampling: side of the square of rendered pixels that is averaged into one image pixel.
        noise: standard deviation of the sensor noise [grey levels].
        flicker: amplitude of the flicker as a fraction of the mean brightness.
        flicker_hz: frequency of the flicker [Hz].
        period: time between frames [s]; each frame has its own noise.
        seed: of the sensor noise.
        camera_index: of the sensor noise; two cameras of one seed need two numbers.
        parent: frame of the scene that carries the camera; None for a camera that is fixed to the world.
        nearest: distance from which on the renderer shows things [m].
    """

    X_WC: RigidTransform
    width: int
    height: int
    fov_deg: float
    window: ImageWindow | None = None
    supersampling: int = 1
    noise: float = 0.0
    flicker: float = 0.0
    flicker_hz: float = 100.0
    period: float = VISION_PERIOD
    seed: int = 0
    camera_index: int = 0
    parent: FrameId | None = None
    nearest: float = 0.1

    @property
    def rendered(self) -> ImageWindow:
        """The part of the full image that is rendered."""
        if self.window is None:
            return (0, 0, self.width, self.height)
        return renderable_window(self.window, self.width, self.height)

    @property
    def sensor(self) -> SensorModel:
        """The Systems that follow the renderer."""
        if self.noise <= 0.0 and self.flicker <= 0.0:
            return SensorModel(self.supersampling)
        noise = SensorNoise(
            width=self.width,
            height=self.height,
            std=self.noise,
            window=self.rendered,
            flicker=self.flicker,
            flicker_hz=self.flicker_hz,
            period=self.period,
            seed=self.seed,
            camera_index=self.camera_index,
        )
        return SensorModel(self.supersampling, noise)

    def core(self, renderer: str = RENDERER_NAME) -> RenderCameraCore:
        """Returns the camera of the renderer with the given name."""
        info = camera_info(self.width, self.height, self.fov_deg, self.rendered, self.supersampling)
        return RenderCameraCore(renderer, info, ClippingRange(self.nearest, _FARTHEST), RigidTransform())


def add_renderer(scene_graph: SceneGraph, *, params: RenderEngineVtkParams, name: str = RENDERER_NAME) -> None:
    """Adds a VTK renderer to a scene graph, unless it has one of that name.

    Args:
        scene_graph: the scene graph.
        params: of the renderer, for example from `render_engine_params`.
        name: of the renderer.
    """
    if not scene_graph.HasRenderer(name):
        scene_graph.AddRenderer(name, MakeRenderEngineVtk(params))


def add_camera(
    builder: DiagramBuilder,
    *,
    scene_graph: SceneGraph,
    name: str,
    optics: CameraOptics,
    renderer: str = RENDERER_NAME,
) -> Camera:
    """Adds a camera that renders when its image is read, and connects it to the scene graph.

    Adds an `RgbdSensor` with the name of the camera, a `PixelBinningSystem` when there is supersampling, and a
    `SensorNoiseSystem` when there is noise or flicker.

    Args:
        builder: of the diagram that has the scene graph.
        scene_graph: has the renderer (see `add_renderer`).
        name: of the camera.
        optics: its pose, lens and sensor.
        renderer: name of the renderer.
    """
    core, model, window = optics.core(renderer), optics.sensor, optics.rendered
    sensor = builder.AddNamedSystem(
        name,
        RgbdSensor(
            optics.parent or scene_graph.world_frame_id(),
            optics.X_WC,
            ColorRenderCamera(core),
            DepthRenderCamera(core, _DEPTH_RANGE),
        ),
    )
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    image_port = sensor.color_image_output_port()
    if model.supersampling > 1:
        binning = builder.AddNamedSystem(f"{name}_pixels", PixelBinningSystem(*window[2:], model.supersampling))
        builder.Connect(image_port, binning.GetInputPort("color_image"))
        image_port = binning.GetOutputPort("color_image")
    if model.noise is not None:
        noise_system = builder.AddNamedSystem(f"{name}_noise", SensorNoiseSystem(model.noise))
        builder.Connect(image_port, noise_system.GetInputPort("color_image"))
        image_port = noise_system.GetOutputPort("color_image")
    return Camera(sensor, sensor.color_image_output_port(), image_port, window, optics.X_WC, model)


def add_late_cameras(
    builder: DiagramBuilder,
    *,
    scene_graph: SceneGraph,
    optics: Mapping[str, CameraOptics],
    params: RenderEngineVtkParams,
    pipeline: ImagePipeline,
) -> dict[str, Camera]:
    """Adds cameras whose images appear some cycles late, as outputs of one `PipelinedCamera` named "cameras".

    Args:
        builder: of the diagram that has the scene graph.
        scene_graph: the scene, complete.
        optics: {name of the camera: its pose, lens and sensor}.
        params: of the renderer.
        pipeline: how late the images are, and who makes them.

    Returns {name: Camera}.
    """
    mounts = {
        name: CameraMount(ColorRenderCamera(each.core()), each.X_WC, each.parent, each.sensor)
        for name, each in optics.items()
    }
    system = add_pipelined_camera(
        builder,
        scene_graph=scene_graph,
        cameras=mounts,
        params=params,
        latency=pipeline.latency,
        processes=pipeline.processes,
        wanted=pipeline.wanted,
    )
    return {
        name: Camera(
            system, system.GetOutputPort(name), system.GetOutputPort(name), each.rendered, each.X_WC, each.sensor
        )
        for name, each in optics.items()
    }


def add_cameras(
    builder: DiagramBuilder,
    *,
    scene_graph: SceneGraph,
    config: CamerasConfig,
    lighting: LightingConfig,
    windows: Mapping[str, ImageWindow] | None = None,
    pipeline: ImagePipeline | None = None,
    seed: int = 0,
    further: Mapping[str, CameraOptics] | None = None,
) -> dict[str, Camera]:
    """Adds the two cameras of the train, camera_left and camera_right, and the renderer unless there is one.

    Args:
        builder: of the diagram that has the scene graph.
        scene_graph: the scene graph; complete, when there is a pipeline.
        config: where the cameras stand, their images and their noise.
        lighting: the lamps and their flicker.
        windows: {name: window} to render only those parts of the images; None renders all of them.
        pipeline: how late the images are, and who makes them; None: they are rendered when they are read.
        seed: of the sensor noise.
        further: {name: optics} of further cameras.

    Returns {name: Camera}.
    """
    params = render_engine_params(lighting, azimuths_deg=config.azimuth_deg, look_at=config.look_at)
    optics = {
        name: CameraOptics(
            X_WC=X_WC,
            width=config.width,
            height=config.height,
            fov_deg=config.fov_deg,
            window=None if windows is None else windows[name],
            noise=config.noise,
            flicker=lighting.flicker,
            flicker_hz=lighting.flicker_hz,
            seed=seed,
            camera_index=index,
        )
        for index, (name, X_WC) in enumerate(camera_poses(config).items())
    } | dict(further or {})
    if pipeline is not None:
        return add_late_cameras(builder, scene_graph=scene_graph, optics=optics, params=params, pipeline=pipeline)
    add_renderer(scene_graph, params=params)
    return {name: add_camera(builder, scene_graph=scene_graph, name=name, optics=each) for name, each in optics.items()}


def start_cameras(cameras: Iterable[Camera]) -> None:
    """Starts the processes that make images for cameras, which otherwise start with the first image.

    Raises MachineError when that is impossible.
    """
    for camera in cameras:
        if isinstance(camera.sensor, PipelinedCamera):
            camera.sensor.start()


def close_cameras(cameras: Iterable[Camera]) -> None:
    """Ends the processes that make images for cameras. They start again when an image is read."""
    for camera in cameras:
        if isinstance(camera.sensor, PipelinedCamera):
            camera.sensor.close()
