"""Makes the custom parts of a scenario by calling a class or function of the user.

This is the only module that imports code named by a scenario, and only with the consent of the user where a file names
it. Reading a scenario imports nothing.
"""

import importlib
import inspect
import sys
import types
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError, raised
from drake_tracker.scenarios.base import Custom
from drake_tracker.scenarios.consent import find_module, require_consent


def make_custom(part: Custom, where: str, role: type) -> Any:
    """Returns the object that the class or function of a custom part makes.

    Args:
        part: module, class or function, and its keyword arguments.
        where: where the part was named, for messages.
        role: what the part must be: a Protocol such as `Estimator`, or a class such as `ArmDescription`.

    Raises DrakeTrackerError when a file names the code and the user does not allow it, when the module or the name in
    it does not exist, when the class or function does not make a part of the role or does not accept the arguments, and
    when it raises an error itself.
    """
    if not part.call.count(".") or not all(name.isidentifier() for name in part.call.split(".")):
        raise DrakeTrackerError(
            f"{where}.call must be module.name, for example my_estimator.MyEstimator, not {part.call!r}"
        )
    require_consent(part)
    make = _find(part, part.folder or find_module(part, [Path.cwd()]), where)
    check_role(make, role, f"{where}: {part.call}")
    try:
        inspect.signature(make).bind(**part.parameters)
    except ValueError:
        pass  # built-in types have no signature
    except TypeError as error:
        takes = ", ".join(inspect.signature(make).parameters) or "no parameters"
        raise DrakeTrackerError(f"{where}: {part.call}: {error}; it takes {takes}") from None
    try:
        return make(**part.parameters)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(f"{where}: {part.call}: {error}") from None
    except (Exception, SystemExit) as error:
        raise DrakeTrackerError(f"{where}: {part.call} {raised(error)}") from error


def _find(part: Custom, folder: str, where: str) -> Callable[..., Any]:
    """Returns the class or function of a custom part.

    Args:
        part: the custom part.
        folder: folder of its module, "" when it is installed.
        where: where the part was named, for messages.
    """
    module_name, _, name = part.call.rpartition(".")
    if folder and folder not in sys.path:
        sys.path.append(folder)  # last, so that installed packages keep their names
    top = module_name.partition(".")[0]
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise DrakeTrackerError(f"{where}: {module_name} {raised(error)}") from error
        looked = f"in {folder}" if folder else f"next to the scenario, in {Path.cwd()} and among installed packages"
        raise DrakeTrackerError(f"{where}: there is no module {error.name}; looked {looked}") from None
    except SyntaxError as error:
        place = f"{Path(error.filename or module_name).name} line {error.lineno}"
        raise DrakeTrackerError(f"{where}: {place}: {error.msg}") from None
    except (Exception, SystemExit) as error:  # SystemExit: the file is a script that calls exit()
        raise DrakeTrackerError(f"{where}: {module_name} {raised(error)}") from error
    file = getattr(sys.modules[top], "__file__", None)
    if folder and not (file and Path(file).resolve().is_relative_to(folder)):
        raise DrakeTrackerError(
            f"{where}: another module is also named {top}: {file or 'a built-in one'}; rename the one in {folder}"
        )
    if not callable(getattr(module, name, None)):
        there = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
        raise DrakeTrackerError(
            f"{where}: {module_name} has no class or function {name}; it has {', '.join(there) or 'none'}"
        )
    return getattr(module, name)


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
    """Returns the methods that a class lacks for a role, "" when none is missing."""
    methods = _methods(role)
    if methods:
        absent = [method for method in methods if not callable(getattr(kind, method, None))]
        return f"has no method {', '.join(absent)}" if absent else ""
    return "" if issubclass(kind, role) else f"is a class that is no {role.__name__}"


def _return_annotation(make: types.FunctionType, role: type) -> Any:
    """Returns the annotation of what a function returns, as a class where that can be found; None without annotation.

    An annotation that is text is looked up by name, because evaluating it would run it. A name that the module imports
    for type checkers only is compared with the name of the role.
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
