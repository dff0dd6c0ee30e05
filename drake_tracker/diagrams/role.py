"""Checks that a class or function of the user makes a part of the role that it is named for, before it is called."""

import types
import typing
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError


def check_role(make: Any, role: type, name: str) -> None:
    """Raises DrakeTrackerError, one line, when a callable does not make a part of a role. Does not call it.

    A class must have the methods of the role's Protocol, or inherit from the role's class. A function must be a Python
    function, and its annotation must state that it returns such a part.

    Args:
        make: the class or function.
        role: a Protocol such as `Estimator`, or a class such as `ArmDescription`.
        name: name of the callable, for the message.
    """
    if isinstance(make, type):
        missing = _missing(make, role)
        if missing:
            has = f"; an {_spoken(role)} has {', '.join(_methods(role))}" if _methods(role) else ""
            raise DrakeTrackerError(f"{name} {missing}{has}")
        return
    if not isinstance(make, types.FunctionType):
        raise DrakeTrackerError(
            f"{name} is a {type(make).__name__}; an {_spoken(role)} is made by a class that is one, or by a Python "
            f"function that is annotated with -> {role.__name__}"
        )
    returns = _return_annotation(make, role)
    if returns is None:
        raise DrakeTrackerError(
            f"{name} does not state what it returns; annotate it: def {make.__name__}(...) -> {role.__name__}"
        )
    if returns is not role and (not isinstance(returns, type) or _missing(returns, role)):
        shown = returns if isinstance(returns, str) else getattr(returns, "__name__", repr(returns))
        raise DrakeTrackerError(
            f"{name} is annotated with -> {shown}; it must return an {_spoken(role)}, {role.__name__}"
        )


def _methods(role: type) -> list[str]:
    """Returns the names of the methods of a Protocol, none for another class."""
    if not getattr(role, "_is_protocol", False):
        return []
    return [name for name in vars(role) if not name.startswith("_") and callable(getattr(role, name))]


def _missing(kind: type, role: type) -> str:
    """Returns what a class lacks to be of a role, "" when nothing."""
    methods = _methods(role)
    if methods:
        absent = [method for method in methods if not callable(getattr(kind, method, None))]
        return f"has no method {', '.join(absent)}" if absent else ""
    return "" if issubclass(kind, role) else f"is a class that is no {role.__name__}"


def _return_annotation(make: types.FunctionType, role: type) -> Any:
    """Returns the annotation of what a function returns, as a class where that can be found; None without annotation.

    An annotation that is text is looked up by name, because evaluating it would run it. A name that the module imports
    for type checkers only is compared with that of the role.
    """
    returns = make.__annotations__.get("return")
    if isinstance(returns, str):
        first, *rest = returns.partition("[")[0].strip().split(".")
        found = make.__globals__.get(first)
        for attribute in rest:
            found = getattr(found, attribute, None)
        if found is None:  # imported for type checkers only
            return role if returns.rpartition(".")[2] == role.__name__ else returns
        returns = found
    return typing.get_origin(returns) or returns


def _spoken(role: type) -> str:
    return "arm" if role.__name__ == "ArmDescription" else role.__name__.lower()
