"""``drake-tracker campaign``: runs many trials, over seeds and a grid of settings."""

import sys
from argparse import ArgumentTypeError, Namespace
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, Commands, add_command, add_scenario, free_name, warn
from drake_tracker.core.processes.signals import exit_code


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "campaign",
        execute,
        help="run many trials, over seeds and a grid of settings",
        description="Runs every trial that the campaign directory does not hold yet. Leaves a table of all trials, "
        "success rates with Wilson intervals, and pictures. Run it again with the same --out to continue an "
        "interrupted campaign.",
        next_step="drake-tracker run SCENARIO --seed N --set KEY.PATH=VALUE repeats one trial with all recordings.",
    )
    add_scenario(command)
    command.add_argument("--trials", type=int, required=True, metavar="N", help="seeds for each combination")
    command.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY.PATH=A,B,C",
        help="values of a setting to try; may be repeated, then every combination is run",
    )
    command.add_argument("--vision", choices=["measured"], help="measured: render no images, which is much faster")
    command.add_argument("--first-seed", type=int, default=0, metavar="N", help="first of the seeds (default: 0)")
    command.add_argument(
        "--workers", type=_workers, metavar="W", help="processes on this machine, or auto: one per core (default: auto)"
    )
    command.add_argument(
        "--scheduler", metavar="ADDRESS", help="use the workers of a dask scheduler at tcp://HOST:PORT"
    )
    command.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="DIR",
        help="campaign directory, new or to be continued (default: runs/campaign-NAME-TIME)",
    )
    command.add_argument("--parquet", action="store_true", help="also write the table as Parquet")


def _workers(text: str) -> int | None:
    try:
        return None if text == "auto" else int(text)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is neither a whole number nor auto") from None


def execute(options: Namespace) -> int:
    """Runs the campaign; returns the exit code."""
    from drake_tracker.campaign.grid import parse_vary
    from drake_tracker.campaign.pool import has_spare_processors, workers_or_all
    from drake_tracker.campaign.run import RATES, TABLE, chooses_rendering, run_campaign
    from drake_tracker.core.progress import TrialsProgress

    vary = parse_vary(options.vary)
    out = options.out or free_name("campaign-" + Path(options.scenario).stem)
    progress = TrialsProgress()
    try:
        campaign = run_campaign(
            options.scenario,
            options.trials,
            vary,
            options.overrides,
            options.first_seed,
            options.vision,
            options.workers,
            options.scheduler,
            out,
            options.parquet,
            progress,
            allow_code=options.allow_code,
            say=warn,
        )
    finally:
        progress.close()
    for line in campaign.notes:
        warn(line)
    for line in campaign.lines():
        print(line)
    if chooses_rendering(campaign.plan) and options.scheduler is None:
        workers = workers_or_all(options.workers)
        beside = "beside the simulations" if has_spare_processors(workers) else "in the processes of the trials"
        print(f"images rendered     {beside}, {workers} at a time")
    print(f"campaign directory  {out}: {TABLE} has one line for each trial, {RATES} one for each rate")
    if campaign.interrupted:
        print(f"drake-tracker: interrupted; finished trials are kept, continue with --out {out}", file=sys.stderr)
        return exit_code()
    return SUCCESS
