"""Runs a scenario: builds the diagram, simulates it, judges it from outside, and leaves the run directory."""

import signal
import threading
import time
from contextlib import contextmanager
from pathlib import Path

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import add_loggers, read_log, save_log, tool_signal
from drake_tracker.core.machine import require_renderer
from drake_tracker.core.messages import ArmCommand
from drake_tracker.tasks import save_scenario
from drake_tracker.tasks.registry import has_images, task_of
from drake_tracker.tasks.train.summary import save_summary

AFTERGLOW = 0.5
"""Simulated time [s] for which a run goes on once its object was taken, or is lost: log and video show it."""
WATCH_PERIOD = 1 / 60
"""Simulated time [s] between looks at the judge's verdict, and a single step of the live view: a cycle of vision."""
_ROUNDING = 1e-9
"""Of sums of steps [s]."""


def simulate(
    scenario,
    out=None,
    record=True,
    meshcat=False,
    progress=None,
    graphviz=None,
    stop=True,
    images=False,
    diagram=None,
    rate=0.0,
    live=None,
):
    """Runs a scenario to its end and returns its summary, a dict.

    The run ends when its object was taken (the train lifted), when it is lost (the train thrown off its track), or
    after ``scenario.duration``.

    Args:
      scenario: a scenario, from `load_scenario`.
      out: directory for summary, log, recording, video and picture; None leaves nothing behind.
      record: whether to make the Meshcat recording and the camera video; with measured vision there is no video.
      meshcat: whether to show the scene live; the address is printed.
      progress: called with (simulated time [s], name of the phase).
      graphviz: file for the picture of the diagram in Graphviz's language.
      stop: False runs for the whole duration whatever happens.
      images: whether to keep the images that the vision reads, for `replay.replay`.
      diagram: what to run in place of the scenario's own diagram, with its ports and rooms.
      rate: simulated time goes no faster than this, 1 being real time; 0 is as fast as it can.
      live: a `LiveView` that shows the run, and may hold it; real-time factor and wall time are without that time.

    Raises DrakeTrackerError on a scenario that cannot be built and, when cameras are needed, on a machine that
    cannot render. What a part of the scenario raises as it runs is raised when everything up to there was written.
    """
    clock = {"start": time.monotonic()}
    task = task_of(scenario)
    if images and not task.needs_renderer(scenario):
        raise DrakeTrackerError(f"{scenario.where('vision')}: there are no images to be recorded with measured vision")
    if task.needs_renderer(scenario):
        require_renderer()
    if live is not None:
        live.introduce(scenario)
    if diagram is None:
        hand_eye = task.make_diagram(scenario, live.mark_windows if live is not None else None)
    else:
        hand_eye = diagram
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    loggers = add_loggers(builder, hand_eye, scenario.task)
    recorders = []
    if out is not None:
        out = Path(out)
        out.mkdir(parents=True, exist_ok=True)
        save_scenario(scenario, out / "scenario.yaml")
        task.keep(hand_eye, out)
    recording = out if record else None
    if has_images(hand_eye) and (recording or live is not None):
        video, onlooker = recording and recording / "cameras.mp4", live and live.frames
        recorders.append(task.add_video(builder, hand_eye, scenario, video, onlooker))
    if has_images(hand_eye) and recording:
        recorders.append(task.add_snapshot(builder, hand_eye, scenario, recording / "motion.png"))
    if out is not None and images:
        from drake_tracker.run.camera_images import add_camera_images

        recorders.append(add_camera_images(builder, hand_eye, out))
    if meshcat or live is not None or recording:
        from drake_tracker.run.scene import add_scene_recording

        file = recording and recording / "recording.html"
        scene = add_scene_recording(builder, hand_eye, file, meshcat, task.view(hand_eye, scenario))
        recorders.append(scene)
    if live is not None:
        live.watch(builder, hand_eye, scenario, task.phases, scene.url)
    diagram = builder.Build()
    diagram.set_name("drake_tracker")
    if graphviz is not None:
        Path(graphviz).write_text(hand_eye.GetGraphvizString(max_depth=1))

    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    watch = _Watch(task, hand_eye, progress, stop, live)
    simulator.set_monitor(watch)
    simulator.set_target_realtime_rate(rate)
    if live is not None:
        live.begin()
    clock["simulate"] = time.monotonic()
    fault = None
    with _interrupts(watch):
        try:
            simulator.Initialize()
            simulator.AdvanceTo(scenario.duration)
        except Exception as error:  # of the user's own part, perhaps: what there is by then is kept
            if context.get_time() <= 0.0:
                raise
            fault, watch.interrupted = error, True
    clock["write"] = time.monotonic()
    if live is not None:
        live.write()

    log = read_log(loggers, context, scenario.task)
    log["tool"] = tool_signal(log["arm_state"], hand_eye.arm.model)
    if out is not None:
        save_log(log, out / "log.npz")
    for recorder in recorders:
        recorder.finish(context)
    summary = task.summarize(hand_eye, scenario, log, context.get_time(), watch.interrupted)
    if out is not None:
        task.draw(hand_eye, scenario, log, summary, out)
    clock["end"] = time.monotonic()
    simulating = clock["write"] - clock["simulate"] - (live.control.held if live is not None else 0.0)
    summary["real_time_factor"] = context.get_time() / simulating
    summary["wall_time_s"] = {
        "build": clock["simulate"] - clock["start"],
        "simulate": simulating,
        "write": clock["end"] - clock["write"],
    }
    if out is not None:
        save_summary(summary, out / "summary.json")
    if fault is not None:
        raise fault
    return summary


class _Watch:
    """The simulator's monitor: reports progress, lets the live view hold the run, and ends it. It reads outputs, and
    changes nothing.
    """

    def __init__(self, task, hand_eye, progress, stop, live=None):
        self._task = task
        self._hand_eye = hand_eye
        self._progress = progress
        self._stop = stop
        self._live = live
        self._next_look = 0.0
        self._over_at = None
        self.interrupted = False

    def __call__(self, root_context):
        now = root_context.get_time()
        if self.interrupted:
            return EventStatus.ReachedTermination(self._hand_eye, "interrupted")
        if now < self._next_look:
            return EventStatus.DidNothing()
        self._next_look = (round(now / WATCH_PERIOD) + 1) * WATCH_PERIOD - _ROUNDING
        context = self._hand_eye.GetMyContextFromRoot(root_context)
        phase = self._task.phases(int(ArmCommand(self._hand_eye.GetOutputPort("command").Eval(context)).phase))
        if self._progress is not None:
            self._progress(now, phase.name.lower())
        if self._live is not None:
            self._live.look(now, int(phase), lambda: self.interrupted)
        verdict = self._task.verdict(self._hand_eye.GetOutputPort("truth_verdict").Eval(context))
        over = self._task.ended(verdict)
        if self._over_at is None and over:
            self._over_at = now
        if self._stop and self._over_at is not None and now >= self._over_at + AFTERGLOW:
            return EventStatus.ReachedTermination(self._hand_eye, over or "the object was taken or is lost")
        return EventStatus.DidNothing()


@contextmanager
def _interrupts(watch):
    """Lets Ctrl-C end the run at its next step, so that what was recorded is kept."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(signum, frame):
        watch.interrupted = True

    previous = signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
