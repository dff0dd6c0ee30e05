"""Runs a scenario: builds and simulates its diagram, records and judges the run, and writes the run directory."""

import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.errors import DrakeTrackerError, FirstError, PartError
from drake_tracker.core.files.atomic_file import unwritable, write_text
from drake_tracker.core.log import LOG_FILE, save_log
from drake_tracker.core.processes.signals import held
from drake_tracker.core.system_check import require_renderer
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.run.log_recorder import LogStreamer, add_loggers, read_log, require_memory, tool_signal
from drake_tracker.run.monitor import Progress, RunMonitor, interrupts
from drake_tracker.run.options import RunOptions
from drake_tracker.run.recorders import add_recorders
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.loader import save_scenario
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.results import save_summary
from drake_tracker.tasks.task import Task

if TYPE_CHECKING:
    from drake_tracker.live.view import LiveView

DEFAULT_OPTIONS = RunOptions()
"""Options of a run that records everything except images."""


def simulate(
    scenario: BaseScenario,
    out: Path | str | None = None,
    options: RunOptions = DEFAULT_OPTIONS,
    *,
    initialisation: Any = None,
    diagram: HandEyeDiagram | None = None,
    progress: Progress | None = None,
    live: "LiveView | None" = None,
    tell: Callable[[str], object] | None = None,
) -> dict[str, Any]:
    """Runs a scenario and returns its summary.

    The run ends when the object was grasped, when it is lost, or after ``scenario.duration``.

    Args:
        scenario: a scenario of any task, for example from `load_scenario`.
        out: run directory for summary, log, scenario, pictures and recordings; None writes nothing.
        options: what is shown and recorded.
        initialisation: the return value of `initialise`; None initialises the task now, if it needs it.
        diagram: diagram to run instead of the scenario's, with the same ports and subsystems.
        progress: called with (simulated time [s], what the arm does and what it waits for).
        live: live view that shows the run and may pause it. Real-time factor and wall times exclude the pauses.
        tell: called with each line of news for the user, for example when the arm begins to reject packets.

    Returns the summary, see the module `summary` of the task, for example `drake_tracker.tasks.train.summary`.

    Raises DrakeTrackerError when the scenario cannot be built, or when it needs images and this machine cannot render.
    An error during the run, for example in a custom part or on a full disk, is raised after everything that can be
    written of the run up to that instant was written. Ctrl-C during the writing takes effect at its end.
    """
    started = time.monotonic()
    task = task_of(scenario)
    _require_cameras(scenario, task, options)
    if live is not None:
        live.introduce(scenario)
    if diagram is None and initialisation is None:
        initialisation = task.initialise(scenario, live.mark_windows if live is not None else None)
    hand_eye = diagram if diagram is not None else task.build(scenario, initialisation)
    with closing(hand_eye.world):
        hand_eye.world.start()
        builder = DiagramBuilder()
        builder.AddSystem(hand_eye)
        operator = live.listen(builder, hand_eye) if live is not None else None
        loggers = add_loggers(builder, hand_eye, task, operator)
        require_memory(loggers, task, scenario.duration)
        if out is not None:
            out = Path(out)
            scenario = _start_directory(out, scenario, task, initialisation)
        recorders = add_recorders(
            builder,
            hand_eye=hand_eye,
            loggers=loggers,
            scenario=scenario,
            task=task,
            out=out,
            options=options,
            live=live,
        )
        root = builder.Build()
        root.set_name("drake_tracker")
        if options.graphviz is not None:
            write_text(options.graphviz, hand_eye.GetGraphvizString(max_depth=1))

        simulator = Simulator(root)
        context = simulator.get_context()
        stream = None if out is None else LogStreamer(out, loggers, task, hand_eye.arm.model)
        monitor = RunMonitor(task, hand_eye, progress, options.stop_when_over, live, stream, tell)
        simulator.set_monitor(monitor)
        simulator.set_target_realtime_rate(options.realtime_rate)
        if live is not None:
            live.begin()
        built = time.monotonic()
        with held() as signals:
            errors = FirstError(_advance(simulator, monitor, scenario.duration, stream))
            simulated = time.monotonic()
            if live is not None:
                live.write()
            log = read_log(loggers, context, task)
            log["tool"] = tool_signal(log["arm_state"], hand_eye.arm.model)
            if out is not None and stream is not None:
                stream.end(context)
                with errors.kept():
                    save_log(log, out / LOG_FILE)
                    stream.remove()
            for recorder in recorders:
                with errors.kept():
                    recorder.finish(context)
            with errors.kept():
                summary = task.summarise(scenario, hand_eye, log, context.get_time(), monitor.interrupted)
                if out is not None:
                    with errors.kept():
                        task.draw(scenario, hand_eye, log, summary, out)
                simulating = simulated - built - (live.control.held if live is not None else 0.0)
                summary["real_time_factor"] = context.get_time() / simulating
                wall_time = {"build": built - started, "simulate": simulating, "write": time.monotonic() - simulated}
                summary["wall_time_s"] = wall_time
                if out is not None:
                    save_summary(summary, out / "summary.json")
            errors.raise_it()
            if monitor.interrupted:  # the run has ended because of them
                signals.clear()
    return summary


def _require_cameras(scenario: BaseScenario, task: Task, options: RunOptions) -> None:
    """Checks that a run that needs images can have them."""
    if task.uses_cameras(scenario):
        require_renderer()
    elif options.images:
        raise DrakeTrackerError(f"{scenario.where('vision')}: measured vision has no images to record")


def _start_directory(out: Path, scenario: BaseScenario, task: Task, initialisation: Any) -> BaseScenario:
    """Creates the run directory, saves scenario and initialisation, and returns the scenario with the results of the
    initialisation."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(out, error) from None
    if initialisation is not None:
        scenario = task.resolved(scenario, initialisation)
        task.save_initialisation(initialisation, out)
    save_scenario(scenario, out / "scenario.yaml")
    return scenario


def _advance(
    simulator: Simulator, monitor: RunMonitor, duration: float, stream: LogStreamer | None
) -> BaseException | None:
    """Simulates until the end of the run; returns the error that ended it after the first instant, if any."""
    with interrupts(monitor):
        try:
            simulator.Initialize()
            simulator.AdvanceTo(duration)
        except BaseException as error:  # from a custom part (also SystemExit), from Drake, or a full disk
            if simulator.get_context().get_time() <= 0.0:
                if stream is not None:
                    stream.remove()
                raise
            monitor.interrupted = True
            if isinstance(error, PartError):
                return PartError(f"{error}, at {simulator.get_context().get_time():.3f} s of the run")
            return error
    return None
