"""Makes the pictures of the README, from one run of the default scenario.

    python docs/make_pictures.py                     runs `train` with seed 0 first, a few minutes
    python docs/make_pictures.py --run runs/train-…  takes the log of a run that is there already

The laboratory is rendered anew from the logged joints and the logged pose of the train, larger and in better light than
the tracking cameras see it: a studio with soft
boxes and one lamp that casts shadows, drawn with four times the pixels that are kept.
"""

import argparse
import tempfile
from pathlib import Path

import cv2
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    Cylinder,
    EnvironmentMap,
    EquirectangularMap,
    InMemoryMesh,
    LightParameter,
    MakeRenderEngineVtk,
    Mesh,
    RenderCameraCore,
    RenderEngineVtkParams,
    Rgba,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from drake_tracker import load_scenario, make_diagram, simulate
from drake_tracker.arm.description import PUMA560
from drake_tracker.diagrams.train_track import draw_track
from drake_tracker.grasp.schema import Phase
from drake_tracker.record.episode import phase_spans
from drake_tracker.record.log import load_log
from drake_tracker.world.cameras import camera_poses
from drake_tracker.world.plant import add_laboratory
from drake_tracker.world.track_visual import add_track_visual

IMAGES = Path(__file__).parent / "images"
OVERSAMPLING = 2
RENDERER = "studio"
COVE_RADIUS, COVE_BEND = 3.4, 1.6
"""Radius [m] of the studio's flat floor, and of the bend that leads from it to the wall."""
LAMP, AMBIENT = 5.4, 0.45
"""Brightness of the lamp that casts shadows and of the soft boxes."""
ENERGY_COLOUR = (0, 176, 255)  # blue, green, red
FIRST_SIGHT = 2.0
"""Simulated time [s] of the images of the two cameras."""


class Studio:
    """Renders the laboratory of a scenario in any posture.

    Args:
      scenario: whose track, train and cameras are shown. folder: where the studio's light may be written.
    """

    def __init__(self, scenario, folder):
        track, _ = draw_track(scenario)
        builder = DiagramBuilder()

        def decorate(plant):
            add_track_visual(plant, track, scenario.table_height)
            add_cove(plant)
            for X_WC in camera_poses(scenario.cameras).values():
                add_camera_stand(plant, X_WC)

        self._laboratory = add_laboratory(
            builder, PUMA560, scenario.train.body, scenario.table_height, scenario.time_step, decorate
        )
        self._scene_graph = self._laboratory.scene_graph
        self._scene_graph.AddRenderer(RENDERER, MakeRenderEngineVtk(studio_light(folder)))
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()

    def pose(self, log, time):
        """Puts arm, fingers and train where they were at ``time`` [s] of a log."""
        laboratory, plant = self._laboratory, self._laboratory.plant
        context = plant.GetMyMutableContextFromRoot(self._context)
        plant.SetPositions(context, laboratory.arm, sample(log["arm_state"], time)[:6])
        plant.SetPositions(context, laboratory.gripper, [0.5 * sample(log["jaws"], time)[0]] * 2)
        train = sample(log["truth_train_state"], time)
        train[:4] /= np.linalg.norm(train[:4])
        plant.SetPositions(context, laboratory.train, train[:7])

    def render(self, eye, target, width, height, fov_deg):
        """Returns a BGR image seen from ``eye`` towards ``target`` [m, W]; ``fov_deg`` is vertical."""
        fov = np.deg2rad(fov_deg)
        info = CameraInfo(width * OVERSAMPLING, height * OVERSAMPLING, fov)
        core = RenderCameraCore(RENDERER, info, ClippingRange(0.05, 20.0), RigidTransform())
        query = self._scene_graph.get_query_output_port().Eval(
            self._scene_graph.GetMyContextFromRoot(self._context)
        )
        image = query.RenderColorImage(
            ColorRenderCamera(core), self._scene_graph.world_frame_id(), looking(eye, target)
        )
        bgr = cv2.cvtColor(np.array(image.data), cv2.COLOR_RGBA2BGR)
        return cv2.resize(bgr, (width, height), interpolation=cv2.INTER_AREA)


def looking(eye, target):
    """Returns X_WC of a camera at ``eye`` that looks at ``target`` [m, W], upright: x right, y down, z forward."""
    forward = np.subtract(target, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RigidTransform(RotationMatrix(np.column_stack([right, np.cross(forward, right), forward])), eye)


def add_cove(plant):
    """Draws the studio's floor, which bends up into its wall all around: looks only."""
    bend = np.linspace(0.0, 0.5 * np.pi, 13)
    radius = np.concatenate([[0.0], COVE_RADIUS + COVE_BEND * np.sin(bend), [COVE_RADIUS + COVE_BEND]])
    height = np.concatenate([[0.0], COVE_BEND * (1.0 - np.cos(bend)), [6.0]])
    # Outward along the profile the normal turns from up to inward.
    slope = np.concatenate([[0.0], bend, [bend[-1]]])
    turn = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    lines = []
    for r, z, a in zip(radius, height, slope):
        lines += [f"v {r * np.cos(t):.4f} {r * np.sin(t):.4f} {z:.4f}" for t in turn]
        lines += [f"vn {-np.sin(a) * np.cos(t):.4f} {-np.sin(a) * np.sin(t):.4f} {np.cos(a):.4f}" for t in turn]
    n = len(turn)
    for i in range(len(radius) - 1):
        for j in range(n):
            corners = (i * n + j, (i + 1) * n + j, (i + 1) * n + (j + 1) % n, i * n + (j + 1) % n)
            lines.append("f " + " ".join(f"{k + 1}//{k + 1}" for k in corners))
    mesh = MemoryFile(contents="\n".join(lines) + "\n", extension=".obj", filename_hint="cove")
    plant.RegisterVisualGeometry(
        plant.world_body(), RigidTransform([0.3, 0.0, 0.0]), Mesh(InMemoryMesh(mesh_file=mesh)), "cove",
        np.array([0.36, 0.38, 0.41, 1.0]),
    )


def add_camera_stand(plant, X_WC):
    """Draws a camera at X_WC on a pole: looks only."""
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


def studio_light(folder):
    """Returns `RenderEngineVtkParams`: soft boxes all around, and a lamp that casts shadows."""
    path = Path(folder) / "studio.hdr"
    cv2.imwrite(str(path), soft_boxes())
    return RenderEngineVtkParams(
        environment_map=EnvironmentMap(texture=EquirectangularMap(path=str(path)), skybox=False),
        lights=[
            LightParameter(
                type="spot", frame="world", position=[2.4, -2.0, 3.6], direction=[-2.0, 2.0, -3.1],
                cone_angle=60.0, intensity=LAMP, color=Rgba(1.0, 0.97, 0.92),
            ),
        ],
        cast_shadows=True,
        shadow_map_size=4096,
        force_to_pbr=True,
        exposure=0.9,
    )


def soft_boxes():
    """Returns an environment of a grey room with a ceiling light and two soft boxes, BGR float32, equirectangular."""
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


def sample(signal, time):
    """Returns the row of a logged signal at ``time`` [s], linear between samples."""
    return np.array([np.interp(time, signal.times, column) for column in signal.data.T])


def moments(log, scenario):
    """Returns {name: time [s]} of the instants worth a picture."""
    spans = phase_spans(log, scenario.time_step)
    lift = [span for span in spans if span.phase == Phase.LIFT][-1]
    close = [span for span in spans if span.phase == Phase.CLOSE and span.start < lift.start][-1]
    track = [span for span in spans if span.phase == Phase.TRACK and span.start < close.start][-1]
    return {"track": track.end - 0.1, "grasp": lift.start, "lift": lift.end}


def draw_laboratory(studio, log, times):
    """Returns the whole laboratory at the end of the lift."""
    studio.pose(log, times["lift"])
    return studio.render((1.66, -2.36, 1.42), (0.70, -0.02, 0.575), 1280, 680, 31.0)


def draw_grasp(studio, log, times):
    """Returns three moments side by side: tracking, grasped, lifted (the paper's figure 14)."""
    views = []
    for name in ("track", "grasp", "lift"):
        studio.pose(log, times[name])
        x, y = sample(log["truth_train_state"], times[name])[4:6]
        views.append(studio.render((x + 0.62, y - 0.98, 0.88), (x, y, 0.60), 424, 424, 26.0))
    return side_by_side(views)


def draw_cameras(scenario):
    """Returns what both cameras see, and beside it the motion energy found in it (the paper's figures 4 and 5)."""
    whole = load_scenario("train", seed=scenario.seed, overrides=["cameras.render_window=false"])
    diagram = make_diagram(whole)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(FIRST_SIGHT)
    seen_and_found = []
    for side in ("left", "right"):
        seen = diagram.GetOutputPort(f"motion_images_{side}").Eval(simulator.get_context())
        grey = cv2.cvtColor(np.clip(np.rint(seen.smoothed), 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)
        energy = cv2.convertScaleAbs(grey, alpha=0.5)
        energy[seen.motion_energy > 0] = ENERGY_COLOUR
        seen_and_found += [grey, energy]
    enlarged = [cv2.resize(image, (317, 317), interpolation=cv2.INTER_CUBIC) for image in seen_and_found]
    return side_by_side([enlarged[k] for k in (0, 2, 1, 3)])


def side_by_side(views):
    """Returns images of one height in a row with white between them."""
    gap = np.full((views[0].shape[0], 4, 3), 255, np.uint8)
    return np.hstack([part for view in views for part in (view, gap)][:-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, metavar="DIR", help="run directory of a train that was lifted")
    options = parser.parse_args()
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        run = options.run or Path(folder) / "run"
        if not options.run:
            simulate(load_scenario("train", seed=0), out=run, record=False)
        scenario = load_scenario(str(run / "scenario.yaml"))
        log = load_log(run / "log.npz")
        times = moments(log, scenario)
        studio = Studio(scenario, folder)
        pictures = {
            "laboratory": draw_laboratory(studio, log, times),
            "grasp": draw_grasp(studio, log, times),
            "cameras": draw_cameras(scenario),
            "tracking": cv2.resize(cv2.imread(str(run / "tracking.png")), (1600, 900), interpolation=cv2.INTER_AREA),
        }
    for name, picture in pictures.items():
        path = IMAGES / f"{name}.png"
        cv2.imwrite(str(path), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
