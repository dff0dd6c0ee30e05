"""Makes the parts of a scenario that are the user's own (`parts.Custom`)."""

import importlib
import inspect
import sys
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError, raised
from drake_tracker.scenarios.base import find_module


def make_custom(part, where):
    """Returns what the class or function of a `Custom` returns, called with its parameters.

    ``where`` the part stands, for messages. Raises DrakeTrackerError, one line, when there is no such module or name in
    it, when the parameters are not its own, and when it raises an error itself.
    """
    make = _find(part, part.folder or find_module(part, [Path.cwd()]), where)
    try:
        inspect.signature(make).bind(**part.parameters)
    except ValueError:
        pass  # Python's own types do not tell
    except TypeError as error:
        takes = ", ".join(inspect.signature(make).parameters) or "no parameters"
        raise DrakeTrackerError(f"{where}: {part.call}: {error}; it takes {takes}") from None
    try:
        return make(**part.parameters)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(f"{where}: {part.call}: {error}") from None
    except (Exception, SystemExit) as error:
        raise DrakeTrackerError(f"{where}: {part.call} {raised(error)}") from error


def _find(part, folder, where):
    module_name, dot, name = part.call.rpartition(".")
    if not dot or not all(part.call.split(".")):
        raise DrakeTrackerError(f"{where}.call must be module.name, for example my_estimator.MyEstimator, not "
                                f"{part.call!r}")  # fmt: skip
    if folder and folder not in sys.path:
        sys.path.append(folder)  # last: what is installed keeps its names
    top = module_name.partition(".")[0]
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise DrakeTrackerError(f"{where}: {module_name} {raised(error)}") from error
        looked = f"in {folder}" if folder else f"beside the scenario, in {Path.cwd()} and among what is installed"
        raise DrakeTrackerError(f"{where}: there is no module {error.name}; looked {looked}") from None
    except SyntaxError as error:
        place = f"{Path(error.filename or module_name).name} line {error.lineno}"
        raise DrakeTrackerError(f"{where}: {place}: {error.msg}") from None
    except (Exception, SystemExit) as error:  # a script that ends with exit() is no module
        raise DrakeTrackerError(f"{where}: {module_name} {raised(error)}") from error
    file = getattr(sys.modules[top], "__file__", None)
    if folder and not (file and Path(file).resolve().is_relative_to(folder)):
        raise DrakeTrackerError(
            f"{where}: {top} is the name of another module, {file or 'one of Python'}; give the one in "
            f"{folder} another name"
        )
    if not callable(getattr(module, name, None)):
        there = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
        raise DrakeTrackerError(
            f"{where}: {module_name} has no class or function {name}; it has {', '.join(there) or 'none'}"
        )
    return getattr(module, name)
