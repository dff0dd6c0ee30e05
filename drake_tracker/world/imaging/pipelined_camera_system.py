"""Cameras whose images appear some cycles late, and are made in the meantime by other processes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import ColorRenderCamera, FrameId, QueryObject, RenderEngineVtkParams, SceneGraph
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.imaging.render_processes import RenderProcesses
from drake_tracker.world.imaging.scene_copy import SceneRenderer, copy_camera, copy_scene
from drake_tracker.world.imaging.sensor_model import SensorModel


@dataclass(frozen=True)
class CameraMount:
    """A camera and where it is mounted.

    Attributes:
        camera: lens and size of the rendered image. The name of its renderer has no meaning.
        X_PB: pose of the camera in the frame that carries it.
        parent: that frame, None for the world.
        sensor: from the rendered image to the camera's image.
    """

    camera: ColorRenderCamera
    X_PB: RigidTransform
    parent: FrameId | None = None
    sensor: SensorModel = SensorModel()


@dataclass(frozen=True, eq=False)
class _Shot:
    """Everything that determines the images of one cycle.

    Attributes:
        cycle: number of the cycle.
        time: of the images [s].
        cameras: pose of each camera as bytes.
        scene: poses of the frames of the scene as bytes.
    """

    cycle: int
    time: float
    cameras: tuple[bytes, ...]
    scene: bytes


@dataclass(frozen=True, eq=False)
class _Shots(FrozenState):
    """The state of a `PipelinedCamera`: the shots of the last cycles, oldest first."""

    shots: tuple[_Shot, ...] = ()


class PipelinedCamera(LeafSystem):
    """Cameras in place of `RgbdSensor` where images are wanted ``latency`` cycles after their capture.

    .. pydrake_system::

        name: PipelinedCamera
        input_ports:
        - geometry_query
        output_ports:
        - camera_left
        - camera_right

    The outputs are named after the cameras. Each is an `ImageRgba8U` that was captured ``latency`` cycles before the
    present cycle, and black before there is one. ``geometry_query`` is a QueryObject of the scene, read every
    ``period`` at ``offset`` in an unrestricted update.

    The state holds the poses of everything that can be seen in the last cycles. Other processes make the images as soon
    as the poses are known, and the simulation goes on. An image is a function of the poses and the time in the state
    alone: a Context that was cloned, changed or set back gives the right image; only, it must be waited for.

    Colour images only, of rigid geometry. The scene must be complete when this System is made, and it must be the scene
    that ``geometry_query`` describes.

    Args:
        scene_graph: the scene.
        cameras: {name of the output port: camera}.
        params: of the renderer: lamps, shadows, background.
        latency: cycles from the capture of an image until it appears; 0 for images of the present.
        processes: number of processes that make images; 0 makes them in this process, when they are read.
        period: of a cycle [s].
        offset: of the capture within a cycle [s].
        wanted: whether the images of a cycle, given by its number, are likely to be read; the others are made only
            if they are read.

    Raises DrakeTrackerError when an argument is out of range, or a geometry cannot be copied.
    """

    def __init__(
        self,
        scene_graph: SceneGraph,
        cameras: Mapping[str, CameraMount],
        params: RenderEngineVtkParams,
        *,
        latency: int,
        processes: int = 1,
        period: float = VISION_PERIOD,
        offset: float = 0.0,
        wanted: Callable[[int], bool] = lambda cycle: True,
    ) -> None:
        super().__init__()
        for name, value, least in (("latency", latency, 0), ("processes", processes, 0), ("cameras", len(cameras), 1)):
            if value < least:
                raise DrakeTrackerError(f"PipelinedCamera: {name} is {value}; it must be {least} or more")
        self._mounts, self._latency = tuple(cameras.values()), latency
        self._period, self._offset, self._wanted = period, offset, wanted
        scene, self._frames = copy_scene(scene_graph, params)
        copies = [copy_camera(mount.camera, mount.sensor) for mount in self._mounts]
        self._processes: RenderProcesses | None = None
        if processes > 0:
            self._processes = RenderProcesses(scene, copies, processes=processes, depth=latency + 1)
        self._make_renderer = partial(SceneRenderer, scene, copies)
        self._renderer: SceneRenderer | None = None
        self._query = self.DeclareAbstractInputPort("geometry_query", Value(QueryObject()))
        self._shots = self.DeclareAbstractState(AbstractValue.Make(_Shots()))
        for number, (name, copy) in enumerate(zip(cameras, copies)):
            height, width, _ = copy.shape
            self.DeclareAbstractOutputPort(
                name,
                partial(Value, ImageRgba8U(width, height)),
                partial(self._calc_image, number),
                {self.time_ticket(), self.abstract_state_ticket(self._shots) if latency else self._query.ticket()},
            )
        if latency > 0:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._capture)

    @property
    def latency(self) -> int:
        """Cycles from the capture of an image until it appears."""
        return self._latency

    @property
    def processes(self) -> list[int]:
        """The process numbers of the processes that run."""
        return [] if self._processes is None else self._processes.running

    def start(self) -> None:
        """Starts the processes now instead of with the first image. Raises MachineError when that is impossible."""
        if self._processes is not None:
            self._processes.start()

    def close(self) -> None:
        """Ends the processes. They start again when an image is read."""
        if self._processes is not None:
            self._processes.close()

    def _cycle(self, time: float) -> int:
        return round((time - self._offset) / self._period)

    def _capture(self, context: Context, state: State) -> None:
        shot = self._shoot(context)
        if self._processes is not None and self._wanted(shot.cycle):
            for number, X_WB in enumerate(shot.cameras):
                self._processes.ask((number, shot.time, X_WB + shot.scene))
        last = context.get_abstract_state(self._shots).get_value().shots[-self._latency :]
        state.get_mutable_abstract_state(self._shots).set_value(_Shots((*last, shot)))

    def _shoot(self, context: Context) -> _Shot:
        query, time = self._query.Eval(context), context.get_time()
        cameras = []
        for mount in self._mounts:
            X_WB = mount.X_PB
            if mount.parent is not None:
                X_WB = query.GetPoseInWorld(mount.parent) @ X_WB
            cameras.append(X_WB.GetAsMatrix34().tobytes())
        scene = np.array([query.GetPoseInWorld(frame).GetAsMatrix34() for frame in self._frames])
        return _Shot(self._cycle(time), time, tuple(cameras), scene.tobytes())

    def _calc_image(self, number: int, context: Context, output: AbstractValue) -> None:
        shot = self._due(context)
        output.get_mutable_value().mutable_data[:] = 0 if shot is None else self._image(number, shot)

    def _due(self, context: Context) -> _Shot | None:
        """Returns the shot whose images appear now, None before there is one."""
        if self._latency == 0:
            return self._shoot(context)
        cycle = self._cycle(context.get_time()) - self._latency
        shots = context.get_abstract_state(self._shots).get_value().shots
        return next((shot for shot in reversed(shots) if shot.cycle == cycle), None)

    def _image(self, number: int, shot: _Shot) -> np.ndarray:
        poses = shot.cameras[number] + shot.scene
        if self._processes is not None:
            return self._processes.image((number, shot.time, poses))
        self._renderer = self._renderer or self._make_renderer()
        return self._renderer.image(number, shot.time, np.frombuffer(poses).reshape(-1, 3, 4))


def add_pipelined_camera(
    builder: DiagramBuilder,
    *,
    scene_graph: SceneGraph,
    cameras: Mapping[str, CameraMount],
    params: RenderEngineVtkParams,
    latency: int,
    processes: int = 1,
    period: float = VISION_PERIOD,
    wanted: Callable[[int], bool] = lambda cycle: True,
    name: str = "cameras",
) -> PipelinedCamera:
    """Adds a `PipelinedCamera` to a diagram and connects it to the scene graph.

    Args:
        builder: of the diagram that has the scene graph.
        scene_graph: the scene, complete.
        cameras: as for `PipelinedCamera`.
        params: as for `PipelinedCamera`.
        latency: as for `PipelinedCamera`.
        processes: as for `PipelinedCamera`.
        period: as for `PipelinedCamera`.
        wanted: as for `PipelinedCamera`.
        name: of the System.

    Raises DrakeTrackerError as `PipelinedCamera` does.
    """
    system = PipelinedCamera(
        scene_graph,
        cameras,
        params,
        latency=latency,
        processes=processes,
        period=period,
        wanted=wanted,
    )
    builder.AddNamedSystem(name, system)
    builder.Connect(scene_graph.get_query_output_port(), system.GetInputPort("geometry_query"))
    return system
