"""A studio: the laboratory of a run, rendered from its log in a larger format and better light than in its cameras.

The light comes from soft boxes and from one lamp that casts shadows. Images are rendered with four times their pixels.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    Cylinder,
    EnvironmentMap,
    EquirectangularMap,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    Rgba,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from drake_tracker.core.log import Signal
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.world.imaging.cameras import camera_poses
from drake_tracker.world.train.plant import add_laboratory
from drake_tracker.world.train.track_visual import add_track_visual
from drake_tracker.world.visual_mesh import add_visual_obj, obj_text

OVERSAMPLING = 2
"""Rendered pixels per pixel of the image, in each direction."""
RENDERER = "studio"
COVE_RADIUS, COVE_BEND = 3.4, 1.6
"""Radius [m] of the studio's flat floor, and of the bend from the floor to the wall."""
LAMP, AMBIENT = 5.4, 0.45
"""Brightness of the lamp that casts shadows and of the soft boxes."""


Places = Sequence[tuple[ModelInstanceIndex, Callable[[Mapping[str, Signal], float], Sequence[float] | np.ndarray]]]
"""(model instance, function (log, time [s]) -> its positions) of everything that moves."""


class Studio:
    """Renders a laboratory at any instant of a log.

    Args:
        laboratory: with the attributes ``plant`` and ``scene_graph``.
        builder: of the laboratory; it must hold nothing else, and is built.
        places: positions of everything that moves.
        folder: for the file of the studio's light.
    """

    def __init__(
        self, laboratory: Any, builder: DiagramBuilder, places: Places, folder: str | os.PathLike[str]
    ) -> None:
        self._laboratory, self._places = laboratory, places
        self._scene_graph = laboratory.scene_graph
        self._scene_graph.AddRenderer(RENDERER, MakeRenderEngineVtk(studio_light(folder)))
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()

    def pose(self, log: Mapping[str, Signal], time: float) -> None:
        """Moves everything to its place at an instant of a log.

        Args:
            log: {name: Signal}.
            time: simulated time [s].
        """
        plant = self._laboratory.plant
        context = plant.GetMyMutableContextFromRoot(self._context)
        for instance, positions in self._places:
            plant.SetPositions(context, instance, positions(log, time))

    def render(
        self, eye: Sequence[float], target: Sequence[float], width: int, height: int, fov_deg: float
    ) -> np.ndarray:
        """Returns a BGR image, shape (height, width, 3).

        Args:
            eye: position of the camera [m, W].
            target: point at which it looks [m, W].
            width: [px].
            height: [px].
            fov_deg: vertical field of view [deg].
        """
        fov = np.deg2rad(fov_deg)
        info = CameraInfo(width * OVERSAMPLING, height * OVERSAMPLING, fov)
        core = RenderCameraCore(RENDERER, info, ClippingRange(0.05, 20.0), RigidTransform())
        query = self._scene_graph.get_query_output_port().Eval(self._scene_graph.GetMyContextFromRoot(self._context))
        image = query.RenderColorImage(
            ColorRenderCamera(core), self._scene_graph.world_frame_id(), looking(eye, target)
        )
        bgr = cv2.cvtColor(np.array(image.data), cv2.COLOR_RGBA2BGR)
        return cv2.resize(bgr, (width, height), interpolation=cv2.INTER_AREA)


def train_studio(setup: TrainSetup, folder: str | os.PathLike[str]) -> Studio:
    """Returns the `Studio` of a run of the train, with track, train and cameras.

    Args:
        setup: the resolved scenario of the run.
        folder: for the file of the studio's light.
    """
    scenario, track = setup.scenario, setup.track
    builder = DiagramBuilder()

    def decorate(plant: MultibodyPlant) -> None:
        add_track_visual(plant, track=track, table_height=scenario.table_height)
        add_cove(plant)
        for X_WC in camera_poses(scenario.cameras).values():
            add_camera_stand(plant, X_WC)

    laboratory = add_laboratory(
        builder,
        description=setup.arm,
        body=scenario.train.body,
        scale=scenario.train.scale,
        colour=scenario.train.colour,
        table_height=scenario.table_height,
        table_colour=scenario.table_colour,
        time_step=scenario.time_step,
        decorate=decorate,
    )
    places: Places = [
        (laboratory.arm, joints_of(laboratory)),
        (laboratory.gripper, lambda log, time: [0.5 * sample(log["jaws"], time)[0]] * 2),
        (laboratory.train, lambda log, time: body_positions(log["truth_train_state"], time)),
    ]
    return Studio(laboratory, builder, places, folder)


def joints_of(laboratory: Any) -> Callable[[Mapping[str, Signal], float], np.ndarray]:
    """Returns a function (log, time [s]) -> joints of the arm [rad]."""
    return lambda log, time: sample(log["arm_state"], time)[: laboratory.plant.num_positions(laboratory.arm)]


def body_positions(state: Signal, time: float) -> np.ndarray:
    """Returns the positions (quaternion, position) of a free body from its logged state."""
    body = sample(state, time)
    body[:4] /= np.linalg.norm(body[:4])
    return body[:7]


def looking(eye: Sequence[float], target: Sequence[float]) -> RigidTransform:
    """Returns X_WC of an upright camera: x right, y down, z forward.

    Args:
        eye: position of the camera [m, W].
        target: point at which it looks [m, W].
    """
    forward: np.ndarray = np.subtract(target, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RigidTransform(RotationMatrix(np.column_stack([right, np.cross(forward, right), forward])), eye)


def add_cove(plant: MultibodyPlant) -> None:
    """Adds the studio's floor, which bends up into its wall on all sides, as visual geometry."""
    bend = np.linspace(0.0, 0.5 * np.pi, 13)
    radius = np.concatenate([[0.0], COVE_RADIUS + COVE_BEND * np.sin(bend), [COVE_RADIUS + COVE_BEND]])
    height = np.concatenate([[0.0], COVE_BEND * (1.0 - np.cos(bend)), [6.0]])
    # Outward along the profile, the normal turns from up to inward.
    slope = np.concatenate([[0.0], bend, [bend[-1]]])
    turn = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    vertices = [(r * np.cos(t), r * np.sin(t), z) for r, z in zip(radius, height) for t in turn]
    normals = [(-np.sin(a) * np.cos(t), -np.sin(a) * np.sin(t), np.cos(a)) for a in slope for t in turn]
    n = len(turn)
    faces = []
    for i in range(len(radius) - 1):
        for j in range(n):
            corners = (i * n + j, (i + 1) * n + j, (i + 1) * n + (j + 1) % n, i * n + (j + 1) % n)
            faces.append([(k, k) for k in corners])
    add_visual_obj(
        plant,
        body=plant.world_body(),
        X_BG=RigidTransform([0.3, 0.0, 0.0]),
        text=obj_text(np.array(vertices), np.array(normals), faces, vertex_decimals=4),
        name="cove",
        colour=(0.36, 0.38, 0.41, 1.0),
    )


def add_camera_stand(plant: MultibodyPlant, X_WC: RigidTransform) -> None:
    """Adds a camera at X_WC on a pole, as visual geometry."""
    world = plant.world_body()
    dark, steel = np.array([0.06, 0.06, 0.07, 1.0]), np.array([0.45, 0.46, 0.48, 1.0])
    name = f"camera_{'left' if X_WC.translation()[1] > 0 else 'right'}"
    parts = (
        ("case", X_WC @ RigidTransform([0.0, 0.0, -0.07]), Box(0.055, 0.05, 0.12), dark),
        ("lens", X_WC @ RigidTransform([0.0, 0.0, -0.005]), Cylinder(0.019, 0.04), steel),
    )
    x, y, z = (X_WC @ RigidTransform([0.0, 0.0, -0.07])).translation()
    pole = ("pole", RigidTransform([x, y, 0.5 * (z - 0.03)]), Cylinder(0.012, z - 0.03), steel)
    foot = ("foot", RigidTransform([x, y, 0.01]), Cylinder(0.11, 0.02), dark)
    for part, X_WG, shape, colour in (*parts, pole, foot):
        plant.RegisterVisualGeometry(world, X_WG, shape, f"{name}_{part}", colour)


def studio_light(folder: str | os.PathLike[str]) -> RenderEngineVtkParams:
    """Returns renderer parameters with soft boxes on all sides and a lamp that casts shadows.

    Args:
        folder: for the file of the environment map.
    """
    path = Path(folder) / "studio.hdr"
    cv2.imwrite(str(path), soft_boxes())
    return RenderEngineVtkParams(
        environment_map=EnvironmentMap(texture=EquirectangularMap(path=str(path)), skybox=False),
        lights=[
            LightParameter(
                type="spot",
                frame="world",
                position=[2.4, -2.0, 3.6],
                direction=[-2.0, 2.0, -3.1],
                cone_angle=60.0,
                intensity=LAMP,
                color=Rgba(1.0, 0.97, 0.92),
            ),
        ],
        cast_shadows=True,
        shadow_map_size=4096,
        force_to_pbr=True,
        exposure=0.9,
    )


def soft_boxes() -> np.ndarray:
    """Returns an equirectangular environment map, BGR float32: grey walls, a ceiling light and two soft boxes."""
    v, u = np.mgrid[0:256, 0:512]
    elevation = 90.0 - 180.0 * (v + 0.5) / 256
    azimuth = 360.0 * (u + 0.5) / 512
    light = 0.22 + 0.35 * np.clip(elevation / 90.0, 0.0, 1.0)
    light[elevation < 0] = 0.16
    light += 2.6 * (elevation > 62)
    for centre in (60.0, 215.0):
        light += 2.4 * ((np.abs(azimuth - centre) < 26) & (np.abs(elevation - 28) < 15))
    light = cv2.GaussianBlur(light.astype(np.float32), (0, 0), 5.0)
    return AMBIENT * np.dstack([1.04 * light, light, 0.97 * light])


def sample(signal: Signal, time: float) -> np.ndarray:
    """Returns the row of a logged signal at ``time`` [s], interpolated linearly between samples."""
    return np.array([np.interp(time, signal.times, column) for column in signal.data.T])
