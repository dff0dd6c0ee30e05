"""Range checks of the parameters of an estimator; each error is one clear line.

A constructor accepts a wider range than a scenario file: every value for which the arithmetic works.
"""

import math
import numbers
from collections.abc import Callable, Collection, Mapping
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.registry import snake_case
from drake_tracker.core.setting import settings_of

MAX_VALUE = 1e9
"""Largest value of any parameter; its square is still far from overflow."""


def check_settings(
    settings: Any, expected: type, *, zero_allowed: Collection[str] = (), upper_limits: Mapping[str, int] | None = None
) -> None:
    """Raises DrakeTrackerError unless the settings can be used.

    The checks follow from the ranges in the settings: an integer must lie in its range, any other number must be
    positive, or zero or more when its range begins at zero. A word must be one of the choices.

    Args:
        settings: what is checked.
        expected: class of which ``settings`` must be an instance; its name appears in the messages.
        zero_allowed: names of settings that may be zero although their range begins above it.
        upper_limits: {name of an integer: its upper limit}, where that is above the end of its range.
    """
    of = snake_case(expected.__name__.removesuffix("Config"))
    if not isinstance(settings, expected):
        raise DrakeTrackerError(f"{of}: settings are {settings!r}; they must be a {expected.__name__}")
    for field in settings_of(settings):
        name, value, limits = field.name, getattr(settings, field.name), field.metadata["range"]
        choices = field.metadata["choices"]
        if choices and value not in choices:
            raise DrakeTrackerError(f"{of}: {name} is {value!r}; allowed are {', '.join(choices)}")
        if limits is None:
            continue
        low, high = limits
        if field.type is int:
            check_integer(of, low, (upper_limits or {}).get(name, high), **{name: value})
        elif low > 0.0 and name not in zero_allowed:
            check_positive(of, **{name: value})
        else:
            check_not_negative(of, **{name: value})


def check_positive(of: str, **values: Any) -> None:
    """Raises DrakeTrackerError unless each value is a finite number above zero.

    Args:
        of: what the parameters belong to, for the message.
        **values: {name of the parameter: value}.
    """
    _check(of, values, "must be positive and finite", lambda value: 0.0 < value <= MAX_VALUE)


def check_not_negative(of: str, **values: Any) -> None:
    """Raises DrakeTrackerError unless each value is a finite number of zero or more.

    Args:
        of: what the parameters belong to, for the message.
        **values: {name of the parameter: value}.
    """
    _check(of, values, "must be zero or more, and finite", lambda value: 0.0 <= value <= MAX_VALUE)


def check_integer(of: str, low: int, high: int, **values: Any) -> None:
    """Raises DrakeTrackerError unless each value is an integer from ``low`` to ``high``.

    Args:
        of: what the parameters belong to, for the message.
        low: smallest allowed value.
        high: largest allowed value.
        **values: {name of the parameter: value}.
    """
    must = f"must be a whole number in {low}..{high}"
    _check(of, values, must, lambda value: isinstance(value, numbers.Integral) and low <= int(value) <= high)


def _check(of: str, values: Mapping[str, Any], must: str, fits: Callable[[Any], bool]) -> None:
    """Raises DrakeTrackerError unless each value is a real number for which ``fits`` returns True."""
    for name, value in values.items():
        number = isinstance(value, numbers.Real) and not isinstance(value, bool) and math.isfinite(value)
        if not (number and fits(value)):
            raise DrakeTrackerError(f"{of}: {name} is {value!r}; it {must}")
