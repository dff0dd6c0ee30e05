"""The one error a user of the package ever needs to catch."""


class DrakeTrackerError(Exception):
    """Bad input or a broken machine.

    The message is one clear line: what is wrong, where, and what is allowed or what to do. The command line prints
    it and exits with code 2.
    """


class MachineError(DrakeTrackerError):
    """The machine cannot do what it is asked for, whatever the scenario: there is no renderer, say."""
