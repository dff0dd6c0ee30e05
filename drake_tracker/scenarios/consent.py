"""The user's consent to code that a scenario file names, and where that code would be found.

A scenario file can come from anybody, and the class or function of a `Custom` part in it is code that would run. It
runs only when the user consents: with ``--allow-code``, with ``load_scenario(..., allow_code=True)``, or by listing the
folder of the file in the environment variable `TRUSTED_FOLDERS`. A part that the user names on the command line or in
Python needs no consent. Nothing in this module imports the code.
"""

import importlib.util
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.regular_file import is_file
from drake_tracker.core.setting import settings_of
from drake_tracker.scenarios.base import Custom

TRUSTED_FOLDERS = "DRAKE_TRACKER_TRUSTED_FOLDERS"
"""Environment variable: absolute folders, separated as in PATH, whose scenario files may name code."""


def is_trusted(file: Path) -> bool:
    """Returns whether a file is in one of the `TRUSTED_FOLDERS` or below; a link counts as where it leads.

    Raises DrakeTrackerError when one of them is not an absolute path.
    """
    folders = [Path(text).expanduser() for text in os.environ.get(TRUSTED_FOLDERS, "").split(os.pathsep) if text]
    for folder in folders:
        if not folder.is_absolute():
            raise DrakeTrackerError(f"{TRUSTED_FOLDERS}: {folder} must be an absolute path")
    return any(file.resolve().is_relative_to(folder.resolve()) for folder in folders)


def require_consent(part: Custom) -> None:
    """Raises DrakeTrackerError, one line, when a file names code of a custom part that the user does not allow."""
    if not part.allowed:
        raise DrakeTrackerError(
            f"{part.named_at}: the file names code to run, {part.call} {code_place(part)}. If you trust it, allow it "
            f"with --allow-code (in Python with allow_code=True), or list its folder in {TRUSTED_FOLDERS}"
        )


def allowed_code(scenario: Any, parts: Iterable[str] | None = None) -> list[str]:
    """Returns a line for each piece of code that a file names and the user allows, with its name and its place.

    Args:
        scenario: a scenario of any task.
        parts: names of the parts that will be made; None for all.

    Raises DrakeTrackerError when the user does not allow one of them.
    """
    lines = []
    for field in settings_of(scenario):
        part = getattr(scenario, field.name)
        if isinstance(part, Custom) and part.named_at and (parts is None or field.name in parts):
            require_consent(part)
            lines.append(f"{part.named_at}: {field.name} runs {part.call} {code_place(part)}")
    return lines


def code_place(part: Custom) -> str:
    """Returns where the module of a custom part would be found: "in /home/me/my_arm.py". Imports nothing."""
    top = part.call.partition(".")[0]
    folder = part.folder or find_module(part, [Path.cwd()])
    if folder:
        return f"in {_module_file(Path(folder), top) or folder}"
    try:
        spec = importlib.util.find_spec(top) if top.isidentifier() else None  # a top-level name: nothing is imported
    except (ImportError, ValueError):
        spec = None
    if spec is None:
        return "of a module that was not found"
    return f"of the installed package {top}" + (f" ({spec.origin})" if spec.has_location else "")


def find_module(part: Custom, folders: Iterable[Path]) -> str:
    """Returns the folder that contains the module of a custom part, or "" when it may be an installed package.

    Args:
        part: the custom part.
        folders: folders to search, in this order.

    Returns the absolute path of the first folder that contains the module.
    """
    top = part.call.partition(".")[0]
    found = (folder for folder in folders if top.isidentifier() and _module_file(folder, top))
    return next((str(Path(folder).resolve()) for folder in found), "")


def _module_file(folder: Path, top: str) -> Path | None:
    """Returns the file of a module or package in a folder, None when there is none."""
    return next((file for file in (folder / f"{top}.py", folder / top / "__init__.py") if is_file(file)), None)
