"""``drake-tracker run``: a scenario, from its start to its verdict."""

from pathlib import Path

from drake_tracker.commands.common import INTERRUPTED, NOT_TAKEN, SUCCESS, add_scenario, forget_if_empty, run_directory
from drake_tracker.errors import DrakeTrackerError

_RESULT_ROWS = {
    "train": (
        ("success", "success", ""),
        ("failure_reason", "reason", ""),
        ("attempts", "attempts", ""),
        ("time_to_grasp_s", "time to grasp", "s"),
        ("lift_height_m", "lift height", "m"),
        ("hold_s", "held", "s"),
        ("prediction_rms_m", "prediction rms", "m"),
        ("real_time_factor", "real-time factor", ""),
    ),
    "ball": (
        ("success", "caught", ""),
        ("failure_reason", "reason", ""),
        ("hand_error_m", "hand error", "m"),
        ("hold_s", "held", "s"),
        ("position_rms_m", "position rms", "m"),
        ("board_in_camera_error", "board in camera", "m, rad"),
        ("board_in_world_error", "board in world", "m, rad"),
        ("real_time_factor", "real-time factor", ""),
    ),
}
"""What is printed of a task's summary: key, label, unit."""


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "run", help="run a scenario", description="Runs a scenario and leaves a run directory."
    )
    add_scenario(command)
    command.add_argument("--seed", type=int, metavar="N", help="seed of every random draw")
    command.add_argument("--duration", type=float, metavar="S", help="longest simulated time [s]")
    command.add_argument("--out", type=Path, metavar="DIR",
                         help="run directory, new or empty (default: runs/NAME-TIME)")
    command.add_argument("--no-record", action="store_true", help="leave no recording and no video")
    command.add_argument("--record-images", action="store_true",
                         help="keep the images that the vision reads, for drake-tracker replay --from images")
    command.add_argument("--meshcat", action="store_true", help="show the run in a browser while it goes on")
    command.add_argument("--graphviz", type=Path, metavar="FILE", help="write the picture of the diagram to FILE")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.progress import Progress
    from drake_tracker.scenarios import load_scenario

    scenario = load_scenario(options.scenario, options.seed, options.duration, options.overrides)
    if options.graphviz and not options.graphviz.absolute().parent.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: there is no folder {options.graphviz.parent}")

    from drake_tracker.simulation import simulate  # Only now: bad input is answered without waiting for Drake.

    out = run_directory(options.out, scenario.name)
    progress = Progress(scenario.duration)
    try:
        summary = simulate(
            scenario, out=out, record=not options.no_record, meshcat=options.meshcat, progress=progress,
            graphviz=options.graphviz, images=options.record_images,
        )
    except DrakeTrackerError:
        forget_if_empty(out)
        raise
    finally:
        progress.close()
    for key, label, unit in _RESULT_ROWS[scenario.task]:
        if summary.get(key) is not None:
            values = summary[key] if isinstance(summary[key], list) else [summary[key]]
            words = ", ".join(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values)
            print(f"{label:<18}{words} {unit}".rstrip())
    print(f"{'run directory':<18}{out}")
    if summary.get("interrupted"):
        return INTERRUPTED
    return SUCCESS if summary["success"] else NOT_TAKEN
