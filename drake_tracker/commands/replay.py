"""``drake-tracker replay``: repeats a recorded run with other settings of its filters, in seconds."""

from argparse import Namespace
from pathlib import Path

from drake_tracker.commands.common import (
    SUCCESS,
    Commands,
    add_command,
    add_consent,
    add_overrides,
    announce_code,
    one_thread,
    quiet_drake,
    run_directory,
    warn,
)
from drake_tracker.core.processes.signals import exit_code

_ROWS = (
    ("position_rms_m", "present position"),
    ("prediction_0.25_s_rms_m", "0.25 s ahead"),
    ("prediction_0.75_s_rms_m", "0.75 s ahead"),
)
"""Rows of the table: key of the result, label."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "replay",
        execute,
        help="repeat the filters of a recorded run with other settings",
        description="Repeats vision or triangulation, estimation, link and servo of a run from its recording, without "
        "simulation and rendering, and compares the result with the ground truth. With unchanged settings the signals "
        "are identical to the last bit.",
        next_step="drake-tracker run SCENARIO --set KEY.PATH=VALUE runs the whole loop with the settings you chose.",
    )
    command.add_argument("run", type=Path, metavar="RUN", help="run directory of drake-tracker run")
    add_overrides(command)
    add_consent(command)
    command.add_argument(
        "--from",
        choices=["images", "centroids", "points"],
        dest="start",
        help="where to begin (default: centroids, or points with measured vision or several objects)",
    )
    command.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="directory, new or empty (default: runs/replay-TIME)"
    )


def execute(options: Namespace) -> int:
    """Replays the run; returns the exit code."""
    one_thread()

    from drake_tracker.core.progress import Progress
    from drake_tracker.replay.recording import open_recording
    from drake_tracker.replay.replay import replay_run

    quiet_drake()
    recording = open_recording(options.run, options.overrides, options.start, options.allow_code)
    for line in recording.warnings:
        warn(line)
    announce_code(recording.scenario, ["estimator"])
    progress = Progress(recording.end)
    with run_directory(options.out, "replay", "replay") as out:
        try:
            result = replay_run(recording, out, progress)
        finally:
            progress.close()
    print(f"{'rms error [mm]':<18}{'recorded':>10}{'replayed':>10}")
    for key, label in _ROWS:
        print(f"{label:<18}{_millimetres(result['recorded'][key])}{_millimetres(result['replayed'][key])}")
    same = [name for name, found in result["signals"].items() if found["identical"]]
    changed = [name for name in result["signals"] if name not in same]
    for label, names in (("identical", same), ("changed", changed)):
        print(f"{label:<18}{', '.join(names) or '-'}")
    print(f"{'real-time factor':<18}{result['real_time_factor']:.1f}")
    print(f"{'directory':<18}{out}")
    return exit_code() if result["interrupted"] else SUCCESS


def _millimetres(length: float | None) -> str:
    return f"{'-' if length is None else format(1e3 * length, '.2f'):>10}"
