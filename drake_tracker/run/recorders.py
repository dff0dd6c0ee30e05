"""Adds the recorders of a run to its diagram."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import VectorLogSink

from drake_tracker.diagrams.hand_eye import HandEyeDiagram, has_images, has_tracks
from drake_tracker.run.options import RunOptions
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.task import Task

if TYPE_CHECKING:
    from drake_tracker.live.view import LiveView


from typing import Protocol

from pydrake.systems.framework import Context


class Recorder(Protocol):
    """A part of a diagram that records a run.

    A recorder reads output ports and writes during the run, so that its files are kept however the run ends.
    """

    def finish(self, root_context: Context) -> None:
        """Completes the recording. It is called once, after the simulation, also when that was interrupted.

        Args:
            root_context: Context of the whole diagram at the end of the simulation.
        """
        ...


def add_recorders(
    builder: DiagramBuilder,
    *,
    hand_eye: HandEyeDiagram,
    loggers: Mapping[str, VectorLogSink],
    scenario: BaseScenario,
    task: Task,
    out: Path | None,
    options: RunOptions,
    live: "LiveView | None" = None,
) -> list[Recorder]:
    """Adds the recorders that the options ask for. Video, scene and their libraries are loaded only when needed.

    Args:
        builder: builder of the run's diagram, which contains ``hand_eye``.
        hand_eye: diagram to record.
        loggers: the return value of `add_loggers`.
        scenario: scenario of the run.
        task: task of the scenario.
        out: run directory, or None.
        options: options of the run.
        live: live view that also receives the recordings, or None.

    Returns the recorders in the order in which they must be finished.
    """
    recorders: list[Recorder] = []
    folder = out if options.record else None
    if has_images(hand_eye) and (folder or live is not None):
        from drake_tracker.run.camera_video import add_camera_video

        path = folder and folder / "cameras.mp4"
        film, onlooker = task.film(scenario, hand_eye), live.frames if live is not None else None
        recorders.append(add_camera_video(builder, hand_eye=hand_eye, film=film, path=path, onlooker=onlooker))
    if has_images(hand_eye) and not has_tracks(hand_eye) and folder:  # a tracker of several has no motion detector
        from drake_tracker.run.motion_snapshot import add_motion_snapshot

        path = folder / "motion.png"
        recorders.append(add_motion_snapshot(builder, hand_eye=hand_eye, snapshot=task.snapshot(scenario), path=path))
    closeup = task.closeup(scenario, hand_eye) if has_images(hand_eye) and folder else None
    if closeup is not None and folder:
        from drake_tracker.run.closeup import add_closeup

        recorders.append(
            add_closeup(builder, hand_eye=hand_eye, loggers=loggers, task=task, closeup=closeup, folder=folder)
        )
    if out is not None and options.images:
        from drake_tracker.run.camera_images import add_camera_images

        recorders.append(add_camera_images(builder, hand_eye=hand_eye, folder=out))
    if out is not None and options.mcap:
        from drake_tracker.run.mcap_recording import add_mcap_recording

        cameras = task.film(scenario, hand_eye) if has_images(hand_eye) else None
        recorders.append(
            add_mcap_recording(builder, hand_eye=hand_eye, loggers=loggers, film=cameras, task=task, folder=out)
        )
    if options.meshcat or live is not None or folder:
        from drake_tracker.run.scene import add_scene_recording

        path, view = folder and folder / "recording.html", task.view(scenario, hand_eye)
        scene = add_scene_recording(builder, hand_eye=hand_eye, view=view, path=path)
        recorders.append(scene)
        if options.meshcat:
            print(f"Meshcat: {scene.show()}", flush=True)
        if live is not None:
            live.watch(builder, hand_eye, scenario, task.phases, scene.show())
    return recorders
