"""Makes the pictures of the documentation, from a run with the filter of 1991, one of the ball and one of the conveyor.

    python docs/make_pictures.py                     runs `train` (seed 0), `ball` (4) and `conveyor` (1) first
    python docs/make_pictures.py --run runs/train-…  takes the log of a run that is there already, of any task

The laboratory is rendered anew from the logged joints and the logged pose of the train or the ball, larger and in
better light than the tracking cameras see it (`drake_tracker/figures/studio.py`).
"""

import argparse
import tempfile
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker import load_scenario, make_diagram, simulate
from drake_tracker.core.constants import SIDES
from drake_tracker.core.log import Signal, load_log
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.figures.grasp_frames import moments, render_frames
from drake_tracker.figures.studio import Studio, add_cove, body_positions, joints_of, sample, train_studio
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks.conveyor.setup import resolve as resolve_conveyor
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.tasks.train.setup import resolve as resolve_train
from drake_tracker.world.ball.ball_fixtures import GATE_TRAVEL
from drake_tracker.world.ball.ball_plant import add_ball_laboratory
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_plant import add_conveyor_laboratory

IMAGES = Path(__file__).parent / "images"
SHOWN = ("track", "grasp", "lift")
ANIMATION_RATE = 15
"""Frames per second of the animation; it plays in real time."""
ANIMATION_SIZE = (760, 440)
ANIMATION_EYE, ANIMATION_TARGET = (1.42, -1.30, 1.02), (0.50, 0.0, 0.60)
ANIMATION_BEFORE, ANIMATION_AFTER = 2.6, 0.4
"""Simulated time [s] shown before the jaws have closed and after the lift."""
CONVEYOR_EYE, CONVEYOR_TARGET, CONVEYOR_FOV = (1.85, -1.05, 1.45), (0.42, 0.0, 0.60), 33.0
CONVEYOR_BEFORE, CONVEYOR_SPAN = 1.2, 5.5
"""Simulated time [s] shown before the first pick, and in all: two cycles."""
ENERGY_COLOUR = (0, 176, 255)  # blue, green, red
BEFORE_CROSSING = 0.3
"""Time [s] before the ball leaves the board at which it is shown."""
FIRST_SIGHT = 2.0
"""Simulated time [s] of the images of the two cameras."""


def ball_studio(scenario, folder):
    """Returns the `Studio` of a scenario of the ball, with board and ball; the gate is open."""
    builder = DiagramBuilder()
    laboratory = add_ball_laboratory(
        builder,
        description=arm_of(scenario),
        board=scenario.board,
        ball=scenario.ball,
        seed=scenario.seed,
        time_step=scenario.time_step,
        decorate=add_cove,
    )
    places = [
        (laboratory.arm, joints_of(laboratory)),
        (laboratory.gate, lambda log, time: [GATE_TRAVEL]),
        (laboratory.ball, lambda log, time: body_positions(log["truth_ball_state"], time)),
    ]
    return Studio(laboratory, builder, places, folder)


def conveyor_studio(setup, folder):
    """Returns the `Studio` of a scenario of the conveyor, with belt, trays and parts."""
    builder = DiagramBuilder()
    scenario, arrivals, motion = setup.scenario, setup.arrivals, make_belt_motion(setup.scenario.belt)
    laboratory = add_conveyor_laboratory(
        builder,
        description=setup.arm,
        belt=scenario.belt,
        tray=scenario.tray,
        motion=motion,
        arrivals=arrivals,
        duration=scenario.duration,
        time_step=scenario.time_step,
        decorate=add_cove,
    )
    places = [
        (laboratory.arm, joints_of(laboratory)),
        (laboratory.gripper, lambda log, time: [0.5 * sample(log["jaws"], time)[0]] * 2),
        (laboratory.belt, lambda log, time: [motion.distance(time)]),
    ]
    for k, part in enumerate(laboratory.parts):
        names = tuple(f"{field}_{k}" for field in BODY_STATE)
        places.append((part.model_instance(), partial(part_positions, names=names)))
    return Studio(laboratory, builder, places, folder)


def part_positions(log, time, names):
    """Returns the positions of a part from the logged states of all parts."""
    states = log["truth_part_states"]
    return body_positions(Signal(states.times, states.view(*names), tuple(names)), time)


def draw_laboratory(studio, log, times):
    """Returns the whole laboratory at the end of the lift."""
    studio.pose(log, times["lift"])
    return studio.render((1.66, -2.36, 1.42), (0.70, -0.02, 0.575), 1280, 680, 31.0)


def save_animation(studio, log, times, path, eye, target, fov_deg):
    """Writes the images of a studio at several times as an animated WebP file that repeats."""
    frames = []
    for time in times:
        studio.pose(log, time)
        image = studio.render(eye, target, *ANIMATION_SIZE, fov_deg)
        frames.append(Image.fromarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB)))
    durations = [round(1000 / ANIMATION_RATE)] * (len(frames) - 1) + [1200]
    frames[0].save(
        path,
        save_all=True,
        append_images=frames[1:],
        duration=durations,
        loop=0,
        quality=72,
        method=6,
        minimize_size=True,
    )


def draw_cameras(scenario):
    """Returns what both cameras see, and beside it the motion energy found in it (the paper's figures 4 and 5)."""
    whole = load_scenario(
        "train", seed=scenario.seed, overrides=["cameras.render_window=false", "cameras.render_processes=0"]
    )
    diagram = make_diagram(whole)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(FIRST_SIGHT)
    seen_and_found = []
    for side in SIDES:
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


def train_pictures(run, folder):
    """Returns {name: BGR image} of a run of the train."""
    scenario = load_scenario(str(run / "scenario.yaml"))
    log = load_log(run / "log.npz")
    times = {moment.name: moment.time for moment in moments(log, scenario)}
    studio = train_studio(resolve_train(scenario), folder)
    return {
        "laboratory": draw_laboratory(studio, log, times),
        "grasp": side_by_side(render_frames(studio, log, [times[name] for name in SHOWN], 424)),
        "cameras": draw_cameras(scenario),
        "tracking": smaller(run / "tracking.png", 1600),
    }


def animate(run, folder):
    """Writes the animation of a run of the train."""
    scenario = load_scenario(str(run / "scenario.yaml"))
    log = load_log(run / "log.npz")
    path = IMAGES / "grasp.webp"
    found = {moment.name: moment.time for moment in moments(log, scenario)}
    times = np.arange(found["grasp"] - ANIMATION_BEFORE, found["lift"] + ANIMATION_AFTER, 1.0 / ANIMATION_RATE)
    save_animation(
        train_studio(resolve_train(scenario), folder), log, times, path, ANIMATION_EYE, ANIMATION_TARGET, 30.0
    )
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def animate_conveyor(run, folder):
    """Writes the animation of a run of the conveyor: two parts are picked and placed."""
    scenario = load_scenario(str(run / "scenario.yaml"))
    log = load_log(run / "log.npz")
    path = IMAGES / "conveyor.webp"
    picks = np.flatnonzero(np.diff(log["diagnosis"]["picked"]) > 0)
    start = log["diagnosis"].times[picks[0]] - CONVEYOR_BEFORE
    times = np.arange(start, start + CONVEYOR_SPAN, 1.0 / ANIMATION_RATE)
    save_animation(
        conveyor_studio(resolve_conveyor(scenario), folder),
        log,
        times,
        path,
        CONVEYOR_EYE,
        CONVEYOR_TARGET,
        CONVEYOR_FOV,
    )
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def ball_pictures(run, folder):
    """Returns {name: BGR image} of a run of the ball."""
    scenario = load_scenario(str(run / "scenario.yaml"))
    log = load_log(run / "log.npz")
    studio = ball_studio(scenario, folder)
    studio.pose(log, log["truth_verdict"]["crossing_time"][-1] - BEFORE_CROSSING)
    return {
        "ball": studio.render((0.95, -2.20, 1.62), (0.47, 0.0, 0.58), 1280, 700, 32.0),
        "ball_path": smaller(run / "ball_path.png", 1600),
    }


def smaller(path, width):
    image = cv2.imread(str(path))
    height = round(width * image.shape[0] / image.shape[1])
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--run", type=Path, metavar="DIR", help="run directory of a train lifted, a ball caught or parts picked"
    )
    parser.add_argument("--animation", action="store_true", help="make only the animations of train and conveyor")
    options = parser.parse_args()
    IMAGES.mkdir(exist_ok=True)
    pictures = {}
    with tempfile.TemporaryDirectory() as folder:
        runs = [options.run]
        if not options.run:
            runs = [Path(folder) / task for task in ("train", "ball", "conveyor")]
            for run, (name, seed) in zip(runs, (("train", 0), ("ball", 4), ("conveyor", 1))):
                overrides = ["vision=!Measured {}"] if name == "conveyor" else []
                simulate(load_scenario(name, seed=seed, overrides=overrides), run, RunOptions(record=False))
        for run in runs:
            task = load_scenario(str(run / "scenario.yaml")).task
            if task == "train":
                animate(run, folder)
            if task == "conveyor":
                animate_conveyor(run, folder)
                pictures["conveyor"] = smaller(run / "conveyor.png", 1600)
            elif not options.animation:
                pictures |= (train_pictures if task == "train" else ball_pictures)(run, folder)
    for name, picture in pictures.items():
        path = IMAGES / f"{name}.png"
        cv2.imwrite(str(path), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
