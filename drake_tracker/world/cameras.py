"""The two fixed cameras: where they stand, what lens they have, and the Systems that render their images.

Half a pixel lies between two conventions. `CameraInfo` names the image's centre (w/2, h/2), as pixel (0, 0) is taken to
span 0..1; OpenCV calls the same point ((w-1)/2, (h-1)/2) because to it a pixel's centre is whole. The renderer follows
the first, every pixel coordinate of this project the second, so the two matrices differ by half a pixel on purpose.

A configuration is any object with the fields of a scenario's ``cameras``: width, height [px], fov_deg (vertical),
distance [m], azimuth_deg (left, right), elevation_deg, look_at (x, y, z) [m, W], noise [grey levels].
"""

import dataclasses

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import OutputPort
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.world.lighting import render_engine_params
from drake_tracker.world.pixel_binning_system import PixelBinningSystem
from drake_tracker.world.sensor_noise_system import SensorNoiseSystem

CAMERA_NAMES = ("camera_left", "camera_right")
RENDERER_NAME = "cameras"
_CLIPPING = ClippingRange(0.1, 10.0)
_DEPTH_RANGE = DepthRange(0.1, 9.9)


@dataclasses.dataclass(frozen=True)
class Camera:
    """One camera of a diagram.

    sensor: the `RgbdSensor` System. image_port: the colour image with noise and flicker, an `ImageRgba8U` of window
    (u0, v0, width, height) [px]: pixel (0, 0) of the image is pixel (u0, v0) of the full frame. X_WC: pose of the
    OpenCV camera frame, truth: for judges and pictures only.
    """

    sensor: RgbdSensor
    image_port: OutputPort
    window: tuple
    X_WC: RigidTransform


def camera_pose(azimuth_deg, elevation_deg, distance, look_at):
    """Returns X_WC of a camera that looks at the point ``look_at`` (3,) [m, W] from ``distance`` [m].

    The camera stands in the direction ``azimuth_deg`` about W's z axis, counted from W's x axis, and ``elevation_deg``
    above the horizon. C follows OpenCV: x right, y down, z forward. Raises DrakeTrackerError when the camera would look
    straight up or down, where its roll is undefined, or when the distance is not positive.
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


def camera_poses(config):
    """Returns {name: X_WC} of the two cameras of a configuration."""
    return {
        name: camera_pose(azimuth_deg, config.elevation_deg, config.distance, config.look_at)
        for name, azimuth_deg in zip(CAMERA_NAMES, config.azimuth_deg, strict=True)
    }


def describe_rig(config):
    """Returns {setting: value} of all that a calibration of these cameras depends on, as plain numbers and lists."""
    return {
        "width": config.width,
        "height": config.height,
        "fov_deg": float(config.fov_deg),
        "distance": float(config.distance),
        "azimuth_deg": [float(angle) for angle in config.azimuth_deg],
        "elevation_deg": float(config.elevation_deg),
        "look_at": [float(x) for x in config.look_at],
    }


def focal_length(height, fov_deg):
    """Returns the focal length [px] of an image ``height`` px high with a vertical field of view ``fov_deg``."""
    return 0.5 * height / np.tan(0.5 * np.deg2rad(fov_deg))


def lens_matrix(config):
    """Returns the (3, 3) intrinsic matrix [px] of a camera with a configuration's image size and field of view."""
    f = focal_length(config.height, config.fov_deg)
    return np.array([[f, 0.0, 0.5 * (config.width - 1)], [0.0, f, 0.5 * (config.height - 1)], [0.0, 0.0, 1.0]])


def true_camera_models(config):
    """Returns {name: CameraModel} of the simulator itself: the truth that a calibration is judged against."""
    return {name: true_camera_model(config, X_WC) for name, X_WC in camera_poses(config).items()}


def true_camera_model(config, X_WC):
    """Returns the CameraModel of the simulator itself for a camera at X_WC."""
    return CameraModel(lens_matrix(config), np.zeros(5), X_WC.inverse().GetAsMatrix4(), config.width, config.height)


def renderable_window(window, width, height):
    """Returns the smallest window (u0, v0, width, height) that holds ``window`` and that Drake can render.

    The result is cut at the edges of the full image (width, height) [px] and contains its centre, because `CameraInfo`
    refuses a principal point outside the image. Raises DrakeTrackerError when the window is empty or outside.
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


def camera_info(width, height, fov_deg, window=None, factor=1):
    """Returns the `CameraInfo` that renders ``window`` (u0, v0, width, height) of a full image of width x height px,
    ``factor`` times as fine.

    The pixels are those of the full image, only fewer, but for the renderer's rounding at a few in ten thousand.
    ``window`` must be a `renderable_window`; None is all of it.
    """
    u0, v0, window_width, window_height = window or (0, 0, width, height)
    f = focal_length(height, fov_deg)
    numbers = (f, f, 0.5 * width - u0, 0.5 * height - v0)
    return CameraInfo(factor * window_width, factor * window_height, *(factor * number for number in numbers))


def add_cameras(builder, scene_graph, config, lighting, *, windows=None, seed=0):
    """Adds the two cameras to a diagram and connects them to the scene graph.

    Adds the renderer unless the scene graph has it, and for each camera what `add_camera` adds, named camera_left or
    camera_right.

    Parameters:
        config, lighting: the scenario's ``cameras`` and ``lighting``.
        windows: {name: (u0, v0, width, height)} [px] to render only those parts of the images; None renders all.
        seed: seed of the sensor noise.

    Returns {name: Camera}.
    """
    if not scene_graph.HasRenderer(RENDERER_NAME):
        scene_graph.AddRenderer(RENDERER_NAME, MakeRenderEngineVtk(render_engine_params(lighting, config)))
    return {
        name: add_camera(
            builder,
            scene_graph,
            name,
            X_WC,
            config,
            lighting,
            window=None if windows is None else windows[name],
            seed=seed,
            camera_index=index,
        )
        for index, (name, X_WC) in enumerate(camera_poses(config).items())
    }


def add_camera(
    builder, scene_graph, name, X_WC, config, lighting, *, window=None, supersampling=1, seed=0, camera_index=0
):
    """Adds one camera at X_WC to a diagram whose scene graph has the renderer `RENDERER_NAME`.

    Adds an `RgbdSensor` called ``name``, fixed to the world, and, where the configuration asks for noise or flicker, a
    `SensorNoiseSystem` behind it.

    Parameters:
        config: width, height [px], fov_deg, noise. lighting: flicker, flicker_hz.
        window: (u0, v0, width, height) [px] to render only that part of the image; None renders all.
        supersampling: side of the square of rendered pixels that is averaged into one.
        seed, camera_index: of the sensor noise.

    Returns Camera.
    """
    if window is None:
        window = (0, 0, config.width, config.height)
    else:
        window = renderable_window(window, config.width, config.height)
    core = RenderCameraCore(
        RENDERER_NAME,
        camera_info(config.width, config.height, config.fov_deg, window, supersampling),
        _CLIPPING,
        RigidTransform(),
    )
    sensor = builder.AddNamedSystem(
        name,
        RgbdSensor(
            scene_graph.world_frame_id(),
            X_WC,
            ColorRenderCamera(core),
            DepthRenderCamera(core, _DEPTH_RANGE),
        ),
    )
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    image_port = sensor.color_image_output_port()
    if supersampling > 1:
        binning = builder.AddNamedSystem(f"{name}_pixels", PixelBinningSystem(*window[2:], supersampling))
        builder.Connect(image_port, binning.GetInputPort("color_image"))
        image_port = binning.GetOutputPort("color_image")
    if config.noise > 0.0 or lighting.flicker > 0.0:
        noise = builder.AddNamedSystem(
            f"{name}_noise",
            SensorNoiseSystem(
                width=config.width,
                height=config.height,
                window=window,
                noise=config.noise,
                flicker=lighting.flicker,
                flicker_hz=lighting.flicker_hz,
                seed=seed,
                camera_index=camera_index,
            ),
        )
        builder.Connect(image_port, noise.GetInputPort("color_image"))
        image_port = noise.GetOutputPort("color_image")
    return Camera(sensor, image_port, window, X_WC)
