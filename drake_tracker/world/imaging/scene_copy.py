"""A copy of the visible parts of a scene, for renderers with a separate scene graph.

`SceneCopy` and `CameraCopy` are plain data, which can be sent to another process. `SceneRenderer` makes images of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    HalfSpace,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    Rgba,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.imaging.sensor_model import SensorModel
from drake_tracker.world.painted_mesh import memory_mesh

_RENDERER = "copy"
_LABEL_GROUP = "label"
"""The group of properties that only label images use."""


HALF_SPACE = "half space"


@dataclass(frozen=True)
class MeshCopy:
    """A mesh whose files are in memory.

    Attributes:
        name: of the OBJ file.
        contents: of the OBJ file.
        files: {name: contents} of its material and its texture.
        scale3: factors along the axes of the mesh, shape (3,).
    """

    name: str
    contents: bytes
    files: dict[str, bytes]
    scale3: np.ndarray


@dataclass(frozen=True)
class CopiedGeometry:
    """One geometry.

    Attributes:
        number: its id, counted from that of the first geometry.
        frame: number of its frame in `SceneCopy.frames`, None for the world.
        X_FG: (4, 4) pose in its frame.
        shape: of Drake; `HALF_SPACE` for a half space and a `MeshCopy` for a mesh with a texture in memory, neither of
            which can be pickled; None for what no camera sees.
        properties: (group, name, value) of each perception property of a colour image. A tuple of four numbers stands
            for an `Rgba`, which cannot be pickled.
    """

    number: int
    frame: int | None
    X_FG: np.ndarray
    shape: Any
    properties: tuple[tuple[str, str, Any], ...]


@dataclass(frozen=True)
class SceneCopy:
    """The visible parts of a scene.

    Attributes:
        geometries: all of the scene, in the order of their ids, the invisible ones included.
        frame_count: number of frames that carry them.
        renderer: parameters of the `RenderEngineVtk` as YAML.
    """

    geometries: tuple[CopiedGeometry, ...]
    frame_count: int
    renderer: str


@dataclass(frozen=True)
class CameraCopy:
    """A camera.

    Attributes:
        size: width and height of the rendered image [px].
        lens: fx, fy, cx, cy [px] in Drake's convention.
        clipping: nearest and farthest distance that is rendered [m].
        X_BS: (4, 4) pose of the sensor in the camera's frame.
        sensor: from the rendered image to the camera's image.
    """

    size: tuple[int, int]
    lens: tuple[float, float, float, float]
    clipping: tuple[float, float]
    X_BS: np.ndarray
    sensor: SensorModel = SensorModel()

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of the camera's images, (h, w, 4)."""
        width, height = (length // self.sensor.supersampling for length in self.size)
        return (height, width, 4)


def copy_camera(camera: ColorRenderCamera, sensor: SensorModel = SensorModel()) -> CameraCopy:
    """Returns the copy of a camera.

    Args:
        camera: of Drake; the name of its renderer has no meaning here.
        sensor: from the rendered image to the camera's image.
    """
    core = camera.core()
    info, clipping = core.intrinsics(), core.clipping()
    return CameraCopy(
        size=(info.width(), info.height()),
        lens=(info.focal_x(), info.focal_y(), info.center_x(), info.center_y()),
        clipping=(clipping.near(), clipping.far()),
        X_BS=core.sensor_pose_in_camera_body().GetAsMatrix4(),
        sensor=sensor,
    )


def copy_scene(scene_graph: SceneGraph, params: RenderEngineVtkParams) -> tuple[SceneCopy, tuple[FrameId, ...]]:
    """Returns the copy of a scene, and the frames of the scene whose poses it needs.

    Args:
        scene_graph: the scene, complete.
        params: of the renderer.

    Raises DrakeTrackerError when a geometry cannot be copied, for example a deformable one.
    """
    inspector = scene_graph.model_inspector()
    world, frames = inspector.world_frame_id(), dict[FrameId, int]()
    ids = sorted(inspector.GetAllGeometryIds(), key=lambda geometry: geometry.get_value())
    geometries = []
    for geometry in ids:
        number, properties = geometry.get_value() - ids[0].get_value(), inspector.GetPerceptionProperties(geometry)
        if properties is None:
            geometries.append(CopiedGeometry(number, None, np.eye(4), None, ()))
            continue
        if inspector.IsDeformableGeometry(geometry):
            name = inspector.GetName(geometry)
            raise DrakeTrackerError(f"geometry {name}: deformable geometries cannot be rendered in another process")
        frame, shape = inspector.GetFrameId(geometry), inspector.GetShape(geometry)
        copied = CopiedGeometry(
            number,
            None if frame == world else frames.setdefault(frame, len(frames)),
            inspector.GetPoseInFrame(geometry).GetAsMatrix4(),
            _copied_shape(shape),
            tuple(
                (group, key, _plain(value.get_value()))
                for group in sorted(properties.GetGroupNames() - {_LABEL_GROUP})
                for key, value in sorted(properties.GetPropertiesInGroup(group).items())
            ),
        )
        geometries.append(copied)
    return SceneCopy(tuple(geometries), len(frames), yaml_dump_typed(params)), tuple(frames)


class SceneRenderer:
    """Makes images of a `SceneCopy` with a scene graph and a `RenderEngineVtk` of its own.

    The renderings are the same as those of an `RgbdSensor`, bit for bit, if its renderer was added to the complete
    scene. Where two surfaces coincide, an image depends on the drawing order, which is the order in Drake's hash tables
    of geometry ids. The copy therefore has as many geometries as the scene, with the same differences between their
    ids.

    Args:
        copy: the scene.
        cameras: the cameras.
    """

    def __init__(self, copy: SceneCopy, cameras: Sequence[CameraCopy]) -> None:
        scene_graph = SceneGraph()
        params = yaml_load_typed(schema=RenderEngineVtkParams, data=copy.renderer)
        source = scene_graph.RegisterSource("copy")
        self._frames = [
            scene_graph.RegisterFrame(source, GeometryFrame(f"frame_{number}")) for number in range(copy.frame_count)
        ]
        last = 0
        for geometry in copy.geometries:
            for _ in range(last + 1, geometry.number):
                GeometryId.get_new_id()
            instance, last = _instance(geometry), geometry.number
            if geometry.frame is None:
                scene_graph.RegisterAnchoredGeometry(source, instance)
            else:
                scene_graph.RegisterGeometry(source, self._frames[geometry.frame], instance)
        scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(params))
        self._scene_graph, self._poses = scene_graph, scene_graph.get_source_pose_port(source)
        self._context = scene_graph.CreateDefaultContext()
        self._cameras = [(_render_camera(camera), camera.sensor) for camera in cameras]

    def image(self, camera: int, time: float, poses: np.ndarray) -> np.ndarray:
        """Returns the image of a camera, RGBA, uint8, of its shape.

        Args:
            camera: number of the camera.
            time: of the image [s].
            poses: in W: of the camera, then of the frames of the scene, shape (1 + n, 3, 4).
        """
        X_WB, *X_WFs = map(RigidTransform, poses)
        vector = FramePoseVector()
        for frame, X_WF in zip(self._frames, X_WFs):
            vector.set_value(frame, X_WF)
        self._poses.FixValue(self._context, vector)
        query = self._scene_graph.get_query_output_port().Eval(self._context)
        render_camera, sensor = self._cameras[camera]
        rendered = query.RenderColorImage(render_camera, self._scene_graph.world_frame_id(), X_WB)
        return sensor.image(rendered.data, time)


def _copied_shape(shape: Shape) -> Any:
    """Returns the shape of a `CopiedGeometry`."""
    if isinstance(shape, HalfSpace):
        return HALF_SPACE
    if not (isinstance(shape, Mesh) and shape.source().is_in_memory() and shape.source().in_memory().supporting_files):
        return shape
    mesh = shape.source().in_memory()
    files = {name: file.contents() for name, file in mesh.supporting_files.items()}
    return MeshCopy(mesh.mesh_file.filename_hint(), mesh.mesh_file.contents(), files, shape.scale3())


def _instance(geometry: CopiedGeometry) -> GeometryInstance:
    X_FG, shape, name = RigidTransform(geometry.X_FG), geometry.shape, f"geometry_{geometry.number}"
    if shape is None:
        return GeometryInstance(X_FG, Sphere(1.0), name)
    if isinstance(shape, MeshCopy):
        shape = memory_mesh(shape.name, shape.contents, shape.files, shape.scale3)
    instance = GeometryInstance(X_FG, HalfSpace() if isinstance(shape, str) else shape, name)
    properties = PerceptionProperties()
    for group, key, value in geometry.properties:
        properties.AddProperty(group, key, Rgba(*value) if isinstance(value, tuple) else value)
    instance.set_perception_properties(properties)
    return instance


def _render_camera(camera: CameraCopy) -> ColorRenderCamera:
    info, X_BS = CameraInfo(*camera.size, *camera.lens), RigidTransform(camera.X_BS)
    return ColorRenderCamera(RenderCameraCore(_RENDERER, info, ClippingRange(*camera.clipping), X_BS))


def _plain(value: Any) -> Any:
    return (value.r(), value.g(), value.b(), value.a()) if isinstance(value, Rgba) else value
