"""Runs a replay: the controller of a run on recorded signals, much faster than the run."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.log import LOG_FILE, save_log
from drake_tracker.core.processes.signals import held
from drake_tracker.replay.changes import changed_settings
from drake_tracker.replay.judge import Judge, compare_signals
from drake_tracker.replay.parts import make_replay_diagram
from drake_tracker.replay.picture import draw_replay
from drake_tracker.replay.recording import Recording
from drake_tracker.run.log_recorder import add_loggers, read_log
from drake_tracker.tasks.results import made_by

_STRETCH = 1.0
"""Simulated time between two reports of progress [s]."""


def replay_run(
    recording: Recording, out: Path | None = None, progress: Callable[[float, str], object] | None = None
) -> dict[str, Any]:
    """Replays a recording and returns the results, a dict with lengths in m and times in s.

    - ``run``: directory of the run.
    - ``start``: where the replay began.
    - ``changes``: {setting: [before, after]}.
    - ``identical``: whether all replayed signals agree with the signals of the run, bit for bit.
    - ``signals``: what `compare_signals` returns.
    - ``recorded``, ``replayed``: rms errors of run and replay, see `Judge.rms`.
    - ``simulated_s``: length of the replay.
    - ``real_time_factor``, ``wall_time_s``: speed of the replay.
    - ``interrupted``: whether the user ended the replay early, by Ctrl-C.
    - ``processor_time_s``: processor time of the simulation, a better measure on a busy machine.
    - ``package_versions``, ``git_commit``: versions that made the replay.

    Args:
        recording: the recording to replay.
        out: directory for log.npz (the replayed signals), replay.json and replay.png; None writes nothing.
        progress: called with (simulated time [s], a word).

    Raises DrakeTrackerError when the recording cannot be replayed.
    """
    clock = [time.monotonic()]
    diagram = make_replay_diagram(recording)
    builder = DiagramBuilder()
    builder.AddSystem(diagram)
    loggers = add_loggers(builder, diagram, recording.task)
    simulator = Simulator(builder.Build())
    context = simulator.get_context()
    clock.append(time.monotonic())
    processor = time.process_time()
    with held() as signals:
        simulator.Initialize()
        while context.get_time() < recording.end and not signals:
            simulator.AdvanceTo(min(context.get_time() + _STRETCH, recording.end))
            if progress is not None:
                progress(context.get_time(), "replay")
        clock.append(time.monotonic())
        processor = time.process_time() - processor

        replayed = read_log(loggers, context, recording.task)
        judge = Judge(recording.task, recording.recorded, recording.log)
        found = compare_signals(recording.log, replayed)
        result = {
            "run": str(recording.folder.resolve()),
            "start": recording.start,
            "changes": changed_settings(recording.recorded, recording.scenario),
            "identical": all(each["identical"] for each in found.values()),
            "signals": found,
            "recorded": judge.rms(recording.log),
            "replayed": judge.rms(replayed),
            "simulated_s": context.get_time(),
            "interrupted": context.get_time() < recording.end,
            "real_time_factor": context.get_time() / (clock[2] - clock[1]),
            "processor_time_s": processor,
            **made_by(),
        }
        if out is not None:
            save_log(replayed, out / LOG_FILE)
            draw_replay(judge, recording, replayed, result, out / "replay.png")
        build, run, write = clock[1] - clock[0], clock[2] - clock[1], time.monotonic() - clock[2]
        result["wall_time_s"] = {"build": build, "simulate": run, "write": write}
        if out is not None:
            write_text(out / "replay.json", json.dumps(result, indent=2) + "\n")
        if result["interrupted"]:
            signals.clear()
    return result
