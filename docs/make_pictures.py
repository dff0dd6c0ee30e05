"""Makes the pictures of the README, from one run of the default scenario.

    python docs/make_pictures.py                     runs `train` with seed 0 first, some minutes
    python docs/make_pictures.py --run runs/train-…  takes the log of a run that is there already

The laboratory is rendered anew from the logged joints and the logged pose of the train, larger and in better light than
the tracking cameras see it: a procedural studio for reflections, one lamp with shadows, and four times the pixels that are
kept.
"""

import argparse
import tempfile
from pathlib import Path

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
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from drake_tracker import load_scenario, make_diagram, simulate
from drake_tracker.arm.description import PUMA560, models_parser
from drake_tracker.diagrams.train_track import draw_track
from drake_tracker.grasp.schema import Phase
from drake_tracker.record.episode import phase_spans
from drake_tracker.record.log import load_log
from drake_tracker.scenarios import save_scenario
from drake_tracker.timing import VISION_PERIOD
from drake_tracker.world.cameras import camera_poses
from drake_tracker.world.plant import add_laboratory
from drake_tracker.world.track_visual import add_track_visual

IMAGES = Path(__file__).parent / "images"
OVERSAMPLING = 2
RENDERER = "studio"
SKY = np.array([0.50, 0.53, 0.58])
"""The background, linear red, green, blue."""
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
            models_parser(plant).AddModelsFromUrl("package://drake_tracker_models/floor/floor.sdf")
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
    """Returns `RenderEngineVtkParams`: soft boxes all around for reflections, a lamp for shadows, another against them."""
    path = Path(folder) / "studio.hdr"
    cv2.imwrite(str(path), soft_boxes())
    return RenderEngineVtkParams(
        default_clear_color=SKY,
        environment_map=EnvironmentMap(texture=EquirectangularMap(path=str(path)), skybox=False),
        lights=[
            LightParameter(
                type="spot", frame="world", position=[1.9, -1.3, 2.9], direction=[-1.35, 1.25, -2.4],
                cone_angle=40.0, intensity=2.2, color=Rgba(1.0, 0.97, 0.92),
            ),
            LightParameter(type="directional", frame="world", direction=[-0.6, -0.9, -0.6], intensity=0.35),
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
    return np.dstack([1.04 * light, light, 0.97 * light])


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


def two_cameras(scenario):
    """Returns one image: what both cameras see, above, and the motion energy found in it, below (figures 4 and 5)."""
    from pydrake.systems.analysis import Simulator

    whole = load_scenario("train", seed=scenario.seed, overrides=["cameras.render_window=false"])
    diagram = make_diagram(whole)
    simulator = Simulator(diagram, diagram.make_context())
    simulator.AdvanceTo(FIRST_SIGHT)
    columns = []
    for side in ("left", "right"):
        seen = diagram.GetOutputPort(f"motion_images_{side}").Eval(simulator.get_context())
        grey = cv2.cvtColor(np.clip(np.rint(seen.smoothed), 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)
        energy = cv2.convertScaleAbs(grey, alpha=0.45)
        energy[seen.motion_energy > 0] = ENERGY_COLOUR
        columns.append(np.vstack([grey, energy]))
    picture = cv2.resize(np.hstack(columns), None, fx=1.5, fy=1.5, interpolation=cv2.INTER_NEAREST)
    return picture


def run_train(folder):
    """Runs the default scenario; returns its scenario and log."""
    scenario = load_scenario("train", seed=0)
    simulate(scenario, out=folder, record=False)
    return scenario, load_log(Path(folder) / "log.npz")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, metavar="DIR", help="run directory of a train that was lifted")
    options = parser.parse_args()
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        if options.run:
            scenario = load_scenario(str(options.run / "scenario.yaml"))
            log = load_log(options.run / "log.npz")
        else:
            scenario, log = run_train(Path(folder) / "run")
        studio = Studio(scenario, folder)
        times = moments(log, scenario)
    print(times)


if __name__ == "__main__":
    main()
