"""Builds the diagram of a replay from a recording: the parts of the run's scenario, with the changes in it."""

from drake_tracker.arm.servo_system import make_servo_system
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import signals
from drake_tracker.core.timing import GRASP_SLOT, PROJECTOR_SLOT, VISION_PERIOD, servo_slot, vision_slot
from drake_tracker.footage.frame_clock import FrameClock
from drake_tracker.footage.frame_sequence import FrameSequence
from drake_tracker.footage.open_footage import open_footage
from drake_tracker.footage.video_source_system import VideoSource
from drake_tracker.replay.log_source_system import LogSourceSystem
from drake_tracker.replay.replay_diagram import ReplayDiagram
from drake_tracker.run.camera_images import image_file
from drake_tracker.tasks.ball import diagram as ball
from drake_tracker.tasks.train import diagram as train
from drake_tracker.vision.board_poses import POSES_FILE, load_poses
from drake_tracker.vision.triangulator_system import TriangulatorSystem


def make_diagram(recording):
    """Returns the `ReplayDiagram` of a `Recording`.

    Raises DrakeTrackerError, in one line, when a file that it needs is missing or does not belong to it.
    """
    scenario = recording.scenario
    vision, cameras, host = (_train if scenario.task == "train" else _ball)(recording)
    sources = {name: (_log_source(recording, name), "signal") for name in (*recording.sources, "command")}
    sources |= {name: (_video_source(recording, name, size), "image") for name, size in cameras.items()}
    servo = make_servo_system(scenario.servo, scenario.time_step, signals(scenario.task)["target"][0])
    servo.set_name("servo")
    return ReplayDiagram(sources, vision, host, train.scenario_link(scenario), servo)


def _train(recording):
    """Returns the vision or None, {camera: (width, height) [px] of the images that it reads}, and the host."""
    scenario, vision, cameras = recording.scenario, None, {}
    if recording.start == "images":
        windows = train.rendered_windows(recording.recorded)
        vision = train.image_vision(scenario, windows)
        cameras = {f"camera_{side}": window[2:] for side, window in windows.items()}
    elif recording.start == "centroids":
        models = train.load_cameras(scenario)
        vision = TriangulatorSystem(*(models[side] for side in train.SIDES), work_volume=scenario.vision.work_volume)
        vision.set_name("triangulator")
    return vision, cameras, train.scenario_host(scenario)


def _ball(recording):
    """As `_train`."""
    scenario, vision, cameras = recording.scenario, None, {}
    poses = load_poses(recording.folder / POSES_FILE)
    if recording.start == "images":
        vision = ball.board_vision(scenario, poses)
        cameras = {"camera": (scenario.camera.width, scenario.camera.height)}
    elif recording.start == "centroids":
        vision = ball.board_projector(scenario, poses)
        vision.set_name("projector")
    return vision, cameras, ball.scenario_host(scenario, poses)


def _log_source(recording, name):
    """Returns the `LogSourceSystem` of a logged signal, which changes in the slot of the System that made it."""
    task, step = recording.scenario.task, recording.scenario.time_step
    period, offset = signals(task)[name][0], 0.0
    if name == "command":
        offset = servo_slot(GRASP_SLOT, step, period)
    elif (task, name) == ("ball", "point"):
        offset = vision_slot(PROJECTOR_SLOT, step)
    return LogSourceSystem(recording.log[name], period, offset)


def _video_source(recording, name, size):
    """Returns the `VideoSource` of a camera's recorded images; ``size`` (width, height) [px] is what vision expects."""
    path = image_file(recording.folder, name)
    if not path.is_file():
        raise DrakeTrackerError(f"{path}: there are no images of this camera")
    footage = open_footage(str(path), fps=1.0 / VISION_PERIOD)
    if footage.size != tuple(size):
        raise DrakeTrackerError(f"{path}: its images have {footage.size} px, and the run's vision reads {tuple(size)}")
    cycles = round(recording.end / VISION_PERIOD)
    if len(footage.times) < cycles:
        raise DrakeTrackerError(f"{path}: it holds {len(footage.times)} images of {cycles}; it was only half written")
    return VideoSource(FrameSequence(footage, FrameClock(VISION_PERIOD)), VISION_PERIOD)
