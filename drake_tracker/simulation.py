"""Runs a scenario: builds the diagram, simulates it, judges it from outside, and leaves the run directory."""

import signal
import threading
import time
from contextlib import contextmanager
from pathlib import Path

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus

from drake_tracker.doctor import require_renderer
from drake_tracker.errors import DrakeTrackerError
from drake_tracker.messages import ArmCommand
from drake_tracker.record.log import add_loggers, read_log, save_log, tool_signal
from drake_tracker.record.summary import save_summary
from drake_tracker.scenarios import save_scenario
from drake_tracker.tasks import task_of

AFTERGLOW = 0.5
"""Simulated time [s] for which a run goes on once its object was taken, or is lost: log and video show it."""
WATCH_PERIOD = 1 / 60
"""Simulated time [s] between looks at the judge's verdict."""


def simulate(
    scenario, out=None, record=True, meshcat=False, progress=None, graphviz=None, stop=True, images=False, diagram=None,
    rate=0.0,
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

    Raises DrakeTrackerError on a scenario that cannot be built and, when cameras are needed, on a machine that
    cannot render.
    """
    clock = {"start": time.monotonic()}
    task = task_of(scenario)
    if images and not task.needs_renderer(scenario):
        raise DrakeTrackerError(f"{scenario.where('vision')}: there are no images to be recorded with measured vision")
    if task.needs_renderer(scenario):
        require_renderer()
    hand_eye = task.make_diagram(scenario) if diagram is None else diagram
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    loggers = add_loggers(builder, hand_eye, scenario.task)
    recorders = []
    if out is not None:
        out = Path(out)
        out.mkdir(parents=True, exist_ok=True)
        save_scenario(scenario, out / "scenario.yaml")
        task.keep(hand_eye, out)
    if out is not None and record:
        recorders += task.add_recorders(builder, hand_eye, scenario, out)
    if out is not None and images:
        from drake_tracker.record.camera_images import add_camera_images

        recorders.append(add_camera_images(builder, hand_eye, out))
    if meshcat or (out is not None and record):
        from drake_tracker.record.scene import add_scene_recording

        recording = out / "recording.html" if out and record else None
        recorders.append(add_scene_recording(builder, hand_eye, recording, meshcat, task.view(hand_eye, scenario)))
    diagram = builder.Build()
    diagram.set_name("drake_tracker")
    if graphviz is not None:
        Path(graphviz).write_text(hand_eye.GetGraphvizString(max_depth=1))

    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    watch = _Watch(task, hand_eye, progress, stop)
    simulator.set_monitor(watch)
    simulator.set_target_realtime_rate(rate)
    clock["simulate"] = time.monotonic()
    with _interrupts(watch):
        simulator.Initialize()
        simulator.AdvanceTo(scenario.duration)
    clock["write"] = time.monotonic()

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
    simulating = clock["write"] - clock["simulate"]
    summary["real_time_factor"] = context.get_time() / simulating
    summary["wall_time_s"] = {
        "build": clock["simulate"] - clock["start"],
        "simulate": simulating,
        "write": clock["end"] - clock["write"],
    }
    if out is not None:
        save_summary(summary, out / "summary.json")
    return summary


class _Watch:
    """The simulator's monitor: reports progress, and ends the run. It reads the judge's output and changes nothing."""

    def __init__(self, task, hand_eye, progress, stop):
        self._task = task
        self._hand_eye = hand_eye
        self._progress = progress
        self._stop = stop
        self._next_look = 0.0
        self._over_at = None
        self.interrupted = False

    def __call__(self, root_context):
        now = root_context.get_time()
        if self.interrupted:
            return EventStatus.ReachedTermination(self._hand_eye, "interrupted")
        if now < self._next_look:
            return EventStatus.DidNothing()
        self._next_look = now + WATCH_PERIOD
        context = self._hand_eye.GetMyContextFromRoot(root_context)
        if self._progress is not None:
            command = ArmCommand(self._hand_eye.GetOutputPort("command").Eval(context))
            self._progress(now, self._task.phases(int(command.phase)).name.lower())
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
