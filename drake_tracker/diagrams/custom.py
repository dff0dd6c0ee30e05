"""Makes the custom parts of a scenario: whatever a class or function of the user returns.

This is the only module that imports code which a scenario names. Reading a scenario does not.
"""

import importlib
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError, raised
from drake_tracker.scenarios.base import Custom, find_module


def make_custom(part: Custom, where: str) -> Any:
    """Returns what the class or function of a `Custom` returns when it is called with its parameters.

    Args:
        part: names module, class or function, and parameters.
        where: place of the part, for messages.

    Raises DrakeTrackerError, one line, when the module or the name in it does not exist, when it does not accept the
    parameters, and when it raises an error itself.
    """
    make = _find(part, part.folder or find_module(part, [Path.cwd()]), where)
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
    """Returns the class or function of a part, whose module is in ``folder`` or installed."""
    module_name, dot, name = part.call.rpartition(".")
    if not dot or not all(part.call.split(".")):
        raise DrakeTrackerError(
            f"{where}.call must be module.name, for example my_estimator.MyEstimator, not {part.call!r}"
        )
    if folder and folder not in sys.path:
        sys.path.append(folder)  # last, so that installed packages keep their names
    top = module_name.partition(".")[0]
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise DrakeTrackerError(f"{where}: {module_name} {raised(error)}") from error
        looked = f"in {folder}" if folder else f"beside the scenario, in {Path.cwd()} and among installed packages"
        raise DrakeTrackerError(f"{where}: there is no module {error.name}; looked {looked}") from None
    except SyntaxError as error:
        place = f"{Path(error.filename or module_name).name} line {error.lineno}"
        raise DrakeTrackerError(f"{where}: {place}: {error.msg}") from None
    except (Exception, SystemExit) as error:  # a script that calls exit() is not a module
        raise DrakeTrackerError(f"{where}: {module_name} {raised(error)}") from error
    file = getattr(sys.modules[top], "__file__", None)
    if folder and not (file and Path(file).resolve().is_relative_to(folder)):
        raise DrakeTrackerError(
            f"{where}: another module has the name {top}: {file or 'a built-in one'}; rename the one in {folder}"
        )
    if not callable(getattr(module, name, None)):
        there = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
        raise DrakeTrackerError(
            f"{where}: {module_name} has no class or function {name}; it has {', '.join(there) or 'none'}"
        )
    return getattr(module, name)
