"""``drake-tracker replay``: a recorded run again, with other settings of its filters, in seconds."""

import os
import sys
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, add_overrides, forget_if_empty, run_directory
from drake_tracker.core.errors import DrakeTrackerError

_ROWS = (
    ("position_rms_m", "present position"),
    ("prediction_0.25_s_rms_m", "0.25 s ahead"),
    ("prediction_0.75_s_rms_m", "0.75 s ahead"),
)


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "replay",
        help="run a recorded run's filters again, with other settings",
        description="Runs vision or triangulation, estimation, link and servo of a run again on what was recorded of "
        "it, without world, hand and rendering, and says how near to the truth they come. With nothing changed, the "
        "same signals to the last bit.",
    )
    command.add_argument("run", type=Path, metavar="RUN", help="directory that drake-tracker run left")
    add_overrides(command)
    command.add_argument(
        "--from",
        choices=["images", "centroids", "points"],
        dest="start",
        help="where to begin (default: centroids, and points of a run with measured vision)",
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="directory, new or empty (default: runs/replay-TIME)")
    command.set_defaults(action=execute)


def execute(options):
    for variable in ("OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        os.environ.setdefault(variable, "1")  # matrices and images are small: more threads only get in the way

    from drake_tracker.core.progress import Progress
    from drake_tracker.replay.recording import open_recording
    from drake_tracker.replay.replay import replay

    recording = open_recording(options.run, options.overrides, options.start)
    for line in recording.warnings:
        print(f"drake-tracker: {line}", file=sys.stderr)
    out = run_directory(options.out, "replay", "replay")
    progress = Progress(recording.end)
    try:
        result = replay(recording, out, progress)
    except DrakeTrackerError:
        forget_if_empty(out)
        raise
    finally:
        progress.close()
    print(f"{'rms error [mm]':<18}{'recorded':>10}{'replayed':>10}")
    for key, label in _ROWS:
        print(f"{label:<18}{_millimetres(result['recorded'][key])}{_millimetres(result['replayed'][key])}")
    same = [name for name, found in result["signals"].items() if found["identical"]]
    for label, names in (("bit for bit", same), ("other", [name for name in result["signals"] if name not in same])):
        print(f"{label:<18}{', '.join(names) or '-'}")
    print(f"{'real-time factor':<18}{result['real_time_factor']:.1f}")
    print(f"{'directory':<18}{out}")
    return SUCCESS


def _millimetres(length):
    return f"{'-' if length is None else format(1e3 * length, '.2f'):>10}"
