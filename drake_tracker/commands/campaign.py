"""``drake-tracker campaign``: many trials, over seeds and a grid of settings."""

import sys
from pathlib import Path

from drake_tracker.commands.common import INTERRUPTED, SUCCESS, add_scenario, free_name


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "campaign",
        help="run many trials, over seeds and a grid of settings",
        description="Runs every trial of a campaign that its directory does not hold yet, and leaves a table of all, "
        "success rates with their Wilson intervals, and a picture. With --out it goes on where it was stopped.",
    )
    add_scenario(command)
    command.add_argument("--trials", type=int, required=True, metavar="N", help="seeds for each combination")
    command.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY.PATH=A,B,C",
        help="values of a setting to go through; given again, every combination is run",
    )
    command.add_argument("--vision", choices=["measured"], help="measured: render no images")
    command.add_argument("--first-seed", type=int, default=0, metavar="N", help="seeds count up from it (default 0)")
    command.add_argument("--workers", type=int, metavar="W", help="processes of this machine (default: all cores)")
    command.add_argument(
        "--scheduler", metavar="ADDRESS", help="run on the workers of a dask scheduler, tcp://HOST:PORT"
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="campaign directory, new or to go on with (default: runs/campaign-NAME-TIME)",
    )
    command.add_argument("--parquet", action="store_true", help="write the table as Parquet, too")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.campaign.grid import parse_vary
    from drake_tracker.campaign.run import RATES, TABLE, run_campaign
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
        )
    finally:
        progress.close()
    for line in campaign.lines():
        print(line)
    print(f"campaign directory  {out}: {TABLE} has a line for each trial, {RATES} one for each rate")
    if campaign.interrupted:
        print(f"drake-tracker: interrupted; what has ended is kept, go on with --out {out}", file=sys.stderr)
        return INTERRUPTED
    return SUCCESS
