"""``drake-tracker list``: the scenarios, or every setting of one."""

from drake_tracker.commands.common import SUCCESS


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser("list", help="list the scenarios, or the settings of one")
    command.add_argument("scenario", nargs="?", metavar="SCENARIO[:NAME]", help="show every setting of this scenario")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.scenarios.reader import describe_settings
    from drake_tracker.tasks import list_scenarios, load_scenario

    if options.scenario:
        rows = describe_settings(load_scenario(options.scenario))
    else:
        rows = list_scenarios()
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip())
    return SUCCESS
