"""The cases of `golden.py`: short sequences of commands, and the footage and photographs that some of them read."""

import sys
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import cv2
import numpy as np

from drake_tracker.arm.config import HandKind
from drake_tracker.arm.description import ARMS, arms_without
from drake_tracker.core.registry import snake_case
from drake_tracker.estimation.estimator import ESTIMATORS, SURFACE_ESTIMATORS
from drake_tracker.tasks import list_scenarios

MEASURED = "vision=!Measured {}"
SMALL_CIRCLE = ("track.kind=circle", "track.radius=0.1")
"""A track of which the train completes a lap within 5 s, so that the arm descends blindly within 10 s."""
OFTEN = "arrivals.rate=30"
"""Parts arrive so often that the arm of the conveyor places some within 10 s."""
IMAGES, RATE = 120, 30.0
"""Number of images of a clip, and their rate [Hz]."""
FAULTS = {
    "images": ("train:learned", (), "!Flicker {camera: left, at: 1}, !CameraKnocked {camera: right, at: 3}"),
    "scene": ("train:guided", (), "!PassingOccluder {at: 1, for: 1}, !SecondMover {at: 2}"),
    "calibration": ("train:guided", (MEASURED,), "!CalibrationWrong {angle_deg: 0.5}"),
    "link": ("train:guided", (MEASURED,), "!LinkBursts {at: 1, for: 1}, !LinkDelay {at: 2, delay: 0.3}"),
    "host": ("train:guided", (MEASURED, "track.kind=figure_eight"), "!HostStopped {at: 2, for: 0.5}"),
    "train": ("train:guided", (MEASURED,), "!TrainPushed {at: 1.5}, !TrainReversed {at: 2.2}"),
    "arm": ("train:guided", (MEASURED,), "!StickingJoint {joint: 2}, !SlowGripper {}, !WeakGripper {force: 5}"),
    "encoder": (
        "conveyor:measured",
        (OFTEN, "belt.encoder=true"),
        "!EncoderJump {at: 3}, !EncoderStopped {at: 7, for: 0.3}",
    ),
    "belt": ("conveyor", (OFTEN,), "!HandOverBelt {at: 2, for: 3}, !FrozenImage {camera: left, at: 6, for: 1}"),
}
"""{place where a fault acts: (scenario, settings, faults)}."""


@dataclass(frozen=True)
class Case:
    """A case.

    Attributes:
        name: its name.
        commands: arguments of `drake-tracker`, command by command. Files in the current folder belong to the case.
    """

    name: str
    commands: tuple[tuple[str, ...], ...]


def make_cases(inputs):
    """Returns all cases.

    Args:
        inputs: the folder of `write_inputs`.
    """
    return [*_packaged(), *_measured(), *_faults(), *_footage(inputs), *_calibrations(inputs), *_chains()]


def run(scenario, *settings, seconds=6, out="run", options=("--no-record",)):
    """Returns the arguments of a run of ``seconds`` simulated seconds."""
    changes = (part for setting in settings for part in ("--set", setting))
    return ("run", scenario, "--duration", str(seconds), *options, *changes, "--out", out)


def _packaged():
    """Every scenario of the package. The ball is caught by both arms, and the conveyor has cameras or not."""
    for name, _ in list_scenarios():
        belt = name.startswith("conveyor")
        yield Case(name, (run(name, *([OFTEN] if belt else []), seconds=10 if belt else 6),))


def _measured():
    """The train on measured vision, without and with vision until contact: estimators, arms, a lossy link."""
    for kind in ESTIMATORS.makers:
        if kind not in SURFACE_ESTIMATORS:
            change = (MEASURED, f"estimator=!{kind.__name__} {{}}")
            blind = run("train", *change, *SMALL_CIRCLE, seconds=10, out="blind")
            yield Case(f"estimator:{snake_case(kind.__name__)}", (blind, run("train:guided", *change, out="guided")))
    for kind in list(ARMS.makers)[1:]:  # the first one is the default
        if kind not in arms_without(HandKind.GRIPPER):
            yield Case(
                f"arm:{snake_case(kind.__name__)}",
                (run("train:guided", MEASURED, f"arm=!{kind.__name__} {{}}", "train.body=round"),),
            )
    link = "link=!Lossy {drop: 0.3, delay: 0.02, jitter: 0.05, burst: 3}"
    yield Case("link:lossy", (run("train:guided", MEASURED, link, "track.kind=stadium", seconds=8),))


def _faults():
    for place, (scenario, settings, faults) in FAULTS.items():
        seconds = 10 if scenario.startswith("conveyor") else 6
        yield Case(f"fault:{place}", (run(scenario, *settings, f"faults=[{faults}]", seconds=seconds),))


def _footage(inputs):
    rate = ("--fps", str(RATE))
    pair = (str(inputs / "left"), str(inputs / "right"), "--calibration", str(inputs / "stereo.yaml"))
    belt = (str(inputs / "left_two"), str(inputs / "right_two"), "--calibration", str(inputs / "two.yaml"))
    yield Case("track:one-camera", (("track", str(inputs / "one"), *rate, "--out", "track"),))
    yield Case("track:two-cameras", (("track", *pair, *rate, "--no-overlay", "--out", "track"),))
    several = ("--objects", "2", "--no-overlay", "--out")
    yield Case(
        "track:several",
        (("track", *belt, *rate, *several, "both"), ("track", str(inputs / "left_two"), *rate, *several, "one")),
    )


def _calibrations(inputs):
    photographs = (str(inputs / "boards_left"), str(inputs / "boards_right"), "--board", "6x5", "--square", "0.03")
    yield Case("calibrate:rendered", (("calibrate", "train", "-o", "cameras.yaml"),))
    yield Case("calibrate:wrist", (("calibrate", "train:wrist", "--wrist", "-o", "wrist.yaml"),))
    yield Case("calibrate:photographs", (("calibrate", *photographs, "-o", "stereo.yaml"),))


def _chains():
    """Commands that read what another command of the case, or another run, has made."""
    slow = ("--set", SMALL_CIRCLE[0], "--set", SMALL_CIRCLE[1])
    once = ("--seeds", "1", "--laps", "1", "--speeds", "0.1")
    yield Case("measure", (("measure", "train:learned", *slow, *once, "-o", "vision.yaml"),))
    other = ("--set", "estimator=!CoordinatedTurn {}", "--out", "other")
    yield Case(
        "replay:cameras",
        (
            run("train:learned", seconds=6, options=("--record-images",)),  # with all recordings
            ("replay", "run", "--from", "images", "--out", "images"),
            ("replay", "run", *other),
        ),
    )
    same = ("replay", "run", "--out", "same")
    yield Case("replay:points", (run("train:guided", MEASURED), same, ("replay", "run", *other)))
    yield Case("replay:conveyor", (run("conveyor:measured", OFTEN, seconds=10), same))
    trials = ("--trials", "2", "--vision", "measured", "--workers", "1", "--set", "duration=6")
    yield Case("campaign", (("campaign", "train:guided", *trials, "--vary", "track.speed=0.12", "--out", "campaign"),))


def needs_inputs(case, inputs):
    """Returns whether a case reads files of `write_inputs`."""
    return any(argument.startswith(str(inputs)) for command in case.commands for argument in command)


def write_inputs(folder):
    """Writes clips, photographs of a board and calibrations to a new folder, the same in every call."""
    sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))
    import films
    from board_pictures import held, photograph, pose
    from footage_parts import clips as footage_clips
    from footage_parts import several as footage_several

    from drake_tracker.calibration.board_page import parse_board
    from drake_tracker.cameras.camera_model import CameraModel
    from drake_tracker.cameras.files.calibration_file import save_calibration

    folder.mkdir()
    _write_images(folder / "one", footage_clips.make_clip("plain", 0, IMAGES).images)
    for side in ("left", "right"):
        _write_images(folder / side, films.film(side, np.arange(IMAGES) / RATE))
    save_calibration(folder / "stereo.yaml", films.CAMERAS)
    cameras, clips, *_ = footage_several.clip("crossing", 0)
    for side, clip in zip(("left", "right"), clips):
        _write_images(folder / f"{side}_two", clip)
    save_calibration(folder / "two.yaml", dict(zip(("camera_left", "camera_right"), cameras)))
    board = parse_board("6x5", 0.03)
    K = np.array([[380.0, 0.0, 159.5], [0.0, 380.0, 119.5], [0.0, 0.0, 1.0]])
    corners = ((-0.07, -0.05), (0.07, -0.05), (-0.07, 0.05), (0.07, 0.05))
    turns = ((0.5, 0.1, 0.1), (-0.5, 0.2, -0.1), (0.1, 0.5, 0.0), (0.2, -0.5, 0.2))
    poses = [held(board, turn, 0.4 + 0.02 * k, corner) for k, (turn, corner) in enumerate(product(turns, corners))]
    for side, X_CW in (("left", np.eye(4)), ("right", pose((0.0, 0.15, 0.0), (-0.08, 0.0, 0.01)))):
        camera = CameraModel(K, np.zeros(5), X_CW, 320, 240)
        _write_images(folder / f"boards_{side}", [photograph(board, camera, X_WB) for X_WB in poses])


def _write_images(folder, images):
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f"{number:04d}.png"), image)
