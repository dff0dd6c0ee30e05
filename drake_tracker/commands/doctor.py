"""``drake-tracker doctor``: what this machine lacks."""


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser("doctor", help="look whether this machine can run it")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.core import machine

    return machine.main()
