"""Whether what an estimator is built with can be used: one clear line for what cannot."""

import inspect
import math
import numbers

from drake_tracker.core.errors import DrakeTrackerError

GREATEST = 1e9
"""No parameter is greater: its square is still a number to reckon with."""


def positive(of, **values):
    """Raises DrakeTrackerError unless each of the ``values`` of the thing called ``of`` is a number above zero."""
    _check(of, values, "must be positive and finite", lambda value: 0.0 < value <= GREATEST)


def not_negative(of, **values):
    """Raises DrakeTrackerError unless each of the ``values`` of the thing called ``of`` is a number not below zero."""
    _check(of, values, "must be zero or more, and finite", lambda value: 0.0 <= value <= GREATEST)


def whole(of, low, high, **values):
    """Raises DrakeTrackerError unless each of the ``values`` of the thing called ``of`` is an integer in low..high."""
    must = f"must be a whole number in {low}..{high}"
    _check(of, values, must, lambda value: isinstance(value, numbers.Integral) and low <= value <= high)


def build(what, of, values):
    """Returns ``what(**values)``, called ``of`` in messages.

    Raises DrakeTrackerError when ``values`` is no dict of parameters that it has.
    """
    known = list(inspect.signature(what).parameters)
    if not isinstance(values, dict):
        raise DrakeTrackerError(f"{of}: parameters are {values!r}; they must be a dict of {', '.join(known)}")
    for name in values:
        if name not in known:
            raise DrakeTrackerError(f"{of} has no parameter {name!r}; it has {', '.join(known)}")
    try:
        return what(**values)
    except TypeError as error:  # one that has no default is missing
        raise DrakeTrackerError(f"{of}: {error}") from error


def _check(of, values, must, fits):
    for name, value in values.items():
        number = isinstance(value, numbers.Real) and not isinstance(value, bool) and math.isfinite(value)
        if not (number and fits(value)):
            raise DrakeTrackerError(f"{of}: {name} is {value!r}; it {must}")
