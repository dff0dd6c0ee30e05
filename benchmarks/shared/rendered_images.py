"""Renders images of both tasks for the detectors, once and without noise, and keeps them in runs/.

The arm is at rest and there is no loop. The world's own `SensorNoiseSystem` then adds noise and flicker, so that the
same rolls are seen in any light; a shaken camera and an interlaced one are derived from the same images.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker import load_scenario
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import CatchVerdict
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.grasp.ball.board_exit import HAND_YAW
from drake_tracker.tasks.train.diagram import make_world
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.vision.centroid.plane_projection import board_window, camera_on_board
from drake_tracker.vision.region_of_interest import project_region
from drake_tracker.world.ball.ball_board import BALL_RADIUS
from drake_tracker.world.ball.ball_camera import NAME
from drake_tracker.world.ball.ball_world_diagram import BallWorldDiagram
from drake_tracker.world.ball.release_system import draw_delay
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, lens_matrix, true_camera_model
from drake_tracker.world.imaging.sensor_model import SensorNoise
from drake_tracker.world.imaging.sensor_noise_system import SensorNoiseSystem

FOLDER = Path(__file__).resolve().parents[2] / "runs" / "detector_images"
EMPTY_AT = 1.5
"""Time [s] of the image without the ball: the gate is open by then, as it is while the ball rolls."""
ASIDE = (-0.10, 0.0, 0.25)
"""Position of the tool relative to the middle of the board's bottom edge [m, W]: outside the window."""
BEFORE = 12
"""Number of images kept from before the release."""
KNOCK_AFTER = 0.6
"""Time [s] from the command to open the gate to the knock on the board."""
TRAIN_START_UP = 1.0
"""Until this time [s] the train accelerates."""
SHAKE_PIXELS, SHAKE_HZ, SHAKE_DECAY, SHAKE_EVERY = 0.5, 12.0, 0.3, 1.0
"""A camera whose mount rings whenever a door slams: amplitude [px], frequency [Hz], decay time [s], period [s]."""
_STREAM = 90


@dataclass(frozen=True, eq=False)
class Sequence:
    """One camera's images at 60 Hz and the truth about them.

    Attributes:
        images: (n, h, w) uint8, grey, without noise.
        empty: (h, w), the scene without the object.
        times: (n,) [s].
        p_WQ: (n, 3), centre of the object [m].
        uv: (n, 2), image of the centre [px].
        moving: (n,) bool, whether the object moves, so that the image counts.
        X_CW: (4, 4), pose of the world in the camera's frame.
        X_WB: (4, 4), pose of the board, the identity for the train.
        seed: seed of the scenario.
    """

    images: np.ndarray
    empty: np.ndarray
    times: np.ndarray
    p_WQ: np.ndarray
    uv: np.ndarray
    moving: np.ndarray
    X_CW: np.ndarray
    X_WB: np.ndarray
    seed: int


def ball_sequence(seed, kind="plain"):
    """Returns the `Sequence` of a rolling ball; ``kind``: plain, knocked (the board) or shadows."""
    return _kept(f"ball_{kind}_{seed}", lambda: _record_ball(seed, kind), seed)


def train_sequence(seed, laps):
    """Returns the `Sequence` of the left camera of `train:learned` over ``laps`` laps."""
    return _kept(f"train_{seed}_{laps:g}", lambda: _record_train(seed, laps), seed)


def ball_scenario(seed):
    return load_scenario("ball", seed=seed)


def ball_camera(sequence):
    """Returns (the true `CameraModel` in B, the window's mask) of a ball's sequence."""
    scenario = ball_scenario(sequence.seed)
    config, board = scenario.camera, scenario.board
    X_CB = sequence.X_CW @ sequence.X_WB
    camera = camera_on_board(lens_matrix(config), X_CB, config.width, config.height)
    window = board_window(camera, board.width, board.length, 2.0 * BALL_RADIUS, scenario.vision.bottom)
    return camera, window.mask((0, 0, config.width, config.height))


def train_window(seed):
    """Returns the mask of the window of the left camera of `train:learned`."""
    scenario = load_scenario("train:learned", seed=seed)
    camera = resolve(scenario).cameras["left"]
    window = project_region(camera, scenario.vision.work_volume, scenario.vision.outline)
    return window.mask((0, 0, scenario.cameras.width, scenario.cameras.height))


def train_fov(seed):
    """Returns the vertical field of view [deg] of the train's cameras."""
    return load_scenario("train:learned", seed=seed).cameras.fov_deg


def seen(sequence, noise=2.0, flicker=0.0, flicker_hz=100.0, shake=False, interlaced=False):
    """Returns (images, static image, lessons): what a camera sees of a sequence, all uint8.

    The static image was taken some seconds earlier, at a time drawn from the seed. ``lessons`` are the 60 images of the
    empty scene before the sequence, for methods that learn their background.
    """
    height, width = sequence.images.shape[1:]
    rng = np.random.default_rng([sequence.seed, _STREAM])
    earlier = int(rng.integers(180, 600))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    noise = SensorNoise(
        width=width, height=height, std=noise, flicker=flicker, flicker_hz=flicker_hz, seed=sequence.seed
    )
    system = SensorNoiseSystem(noise)
    context = system.CreateDefaultContext()

    def take(grey, frame):
        time = frame * VISION_PERIOD
        if shake:
            since = time % SHAKE_EVERY
            shift = SHAKE_PIXELS * np.exp(-since / SHAKE_DECAY) * np.sin(2.0 * np.pi * SHAKE_HZ * since)
            M = np.array([[1.0, 0.0, shift * np.cos(angle)], [0.0, 1.0, shift * np.sin(angle)]])
            grey = cv2.warpAffine(grey, M, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        if interlaced:  # one field, each of its lines twice
            grey = np.repeat(grey[frame % 2 :: 2], 2, axis=0)
        image = ImageRgba8U(width, height)
        image.mutable_data[:] = cv2.cvtColor(grey, cv2.COLOR_GRAY2RGBA)
        context.SetTime(time)
        system.GetInputPort("color_image").FixValue(context, Value(image))
        return cv2.cvtColor(system.GetOutputPort("color_image").Eval(context).data, cv2.COLOR_RGBA2GRAY)

    first = earlier + 60
    lessons = [take(sequence.empty, earlier + k) for k in range(60)]
    return [take(image, first + k) for k, image in enumerate(sequence.images)], take(sequence.empty, 0), lessons


def _kept(name, record, seed):
    path = FOLDER / f"{name}.npz"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        print(f"rendering {name}", flush=True)
        np.savez_compressed(path, **record())
    with np.load(path) as file:
        return Sequence(**file, seed=seed)


def _record_ball(seed, kind):
    calm = ["camera.noise=0", f"lighting.shadows={str(kind == 'shadows').lower()}"]
    knock = [f"board.knock_time={draw_delay(seed) + KNOCK_AFTER}"] if kind == "knocked" else []
    scenario = load_scenario("ball", seed=seed, overrides=calm + knock)
    world, simulator = _still_ball_world(scenario)
    context = simulator.get_mutable_context()
    images, times, balls = [], [], []
    first = max(0, math.floor(draw_delay(seed) / VISION_PERIOD) - BEFORE)
    for k in range(first, 900):
        simulator.AdvanceTo(k * VISION_PERIOD)
        images.append(_grey(world.GetOutputPort("camera"), context))
        times.append(context.get_time())
        balls.append(world.GetOutputPort("truth_ball_state").Eval(context)[4:7].copy())
        verdict = CatchVerdict(world.GetOutputPort("truth_verdict").Eval(context).copy())
        if verdict.crossing_time:
            break
    X_WB, X_WC = world.laboratory.X_WB, world.cameras[NAME].X_WC
    empty_world, empty = _still_ball_world(load_scenario("ball", seed=seed, overrides=calm), False)
    empty.AdvanceTo(draw_delay(seed) + EMPTY_AT)
    p_BQ = X_WB.inverse().multiply(np.transpose(balls)).T
    times = np.array(times)
    seen_whole = p_BQ[:, 1] >= scenario.vision.bottom + 2.0 * BALL_RADIUS
    return {
        "images": np.array(images),
        "empty": _grey(empty_world.GetOutputPort("camera"), empty.get_mutable_context()),
        "times": times,
        "p_WQ": np.array(balls),
        "uv": true_camera_model(scenario.camera, X_WC).project(balls),
        "moving": seen_whole & (times > verdict.released + 0.1),
        "X_CW": X_WC.inverse().GetAsMatrix4(),
        "X_WB": X_WB.GetAsMatrix4(),
    }


def _still_ball_world(scenario, ball_on_board=True):
    """Returns (world, Simulator): the arm is at rest outside the window and counts as ready from the start."""
    description = arm_of(scenario)
    model = make_arm_model(description)
    p_WT = np.add(scenario.board.edge_position, ASIDE)
    q = joints_for(model, description.q_start, tool_down(p_WT, HAND_YAW))
    config = WorldConfig(
        arm=description, q_initial=q, lighting=scenario.lighting, seed=scenario.seed, time_step=scenario.time_step
    )
    world = BallWorldDiagram(
        config, board=scenario.board, ball=scenario.ball, camera=scenario.camera, ball_on_board=ball_on_board
    )
    simulator = Simulator(world)
    context = simulator.get_mutable_context()
    _hold(world, context, model, q)
    world.GetInputPort("ready").FixValue(context, [1.0])
    return world, simulator


def _record_train(seed, laps):
    scenario = load_scenario("train:learned", seed=seed, overrides=["cameras.noise=0"])
    setup = resolve(scenario)
    model, q, track = setup.reach.model, setup.reach.q_initial, setup.track
    whole = (0, 0, scenario.cameras.width, scenario.cameras.height)
    world = make_world(setup, dict.fromkeys(CAMERA_NAMES, whole))
    simulator = Simulator(world)
    context = simulator.get_mutable_context()
    _hold(world, context, model, q)
    world.GetInputPort("gripper_desired_state").FixValue(context, [0.5 * scenario.grasp.jaw_opening, 0.0])
    count = round((laps * track.length / scenario.track.speed + TRAIN_START_UP) / VISION_PERIOD)
    images, trains = [], []
    for k in range(count):
        simulator.AdvanceTo(k * VISION_PERIOD)
        images.append(_grey(world.GetOutputPort("camera_left"), context))
        trains.append(world.GetOutputPort("truth_train_state").Eval(context)[4:7].copy())
    X_WC = world.cameras["camera_left"].X_WC
    times = VISION_PERIOD * np.arange(count)
    images = np.array(images)
    return {
        "images": images,
        "empty": np.median(images[:: max(1, count // 60)], axis=0).astype(np.uint8),
        "times": times,
        "p_WQ": np.array(trains),
        "uv": true_camera_model(scenario.cameras, X_WC).project(trains),
        "moving": times > TRAIN_START_UP,
        "X_CW": X_WC.inverse().GetAsMatrix4(),
        "X_WB": RigidTransform().GetAsMatrix4(),
    }


def _hold(world, context, model, q):
    scratch = model.plant.CreateDefaultContext()
    model.plant.SetPositions(scratch, q)
    gravity = model.plant.CalcGravityGeneralizedForces(scratch)
    world.GetInputPort("arm_desired_state").FixValue(context, np.append(q, np.zeros(len(q))))
    world.GetInputPort("arm_feedforward").FixValue(context, -gravity[: len(q)])


def _grey(port, context):
    return cv2.cvtColor(port.Eval(context).data, cv2.COLOR_RGBA2GRAY)
