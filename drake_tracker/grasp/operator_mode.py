"""What an operator can want of the arm."""

from enum import IntEnum


class OperatorMode(IntEnum):
    """What the operator wants: values of `OperatorCommand`'s ``mode`` field."""

    SUPERVISE = 0
    STOP = 1
    TAKE_OVER = 2
