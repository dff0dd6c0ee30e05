"""Finds, reads, checks and writes scenarios.

A scenario file is a YAML mapping from names to scenarios. The scenario with the name of the file is the default of the
file. A scenario may extend another one in the same file with ``base: NAME``, or one of the package with ``base: TASK``
or ``base: TASK:NAME``; a name in the same file comes first. ``train:interlaced`` is the scenario ``interlaced`` in the
``train.yaml`` of the package; ``my/file.yaml:name`` is a scenario in a file of the user.
"""

import dataclasses
import difflib
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError, DrakeTrackerWarning
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import is_file, read_text
from drake_tracker.core.setting import settings_of
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.scenarios.consent import find_module, is_trusted
from drake_tracker.scenarios.reader import fields_at, read, tag_kinds
from drake_tracker.scenarios.tree import Value, dump, merge, nest, parse, parse_file, plain, tree_of
from drake_tracker.tasks.registry import TASKS

PACKAGE_FOLDERS = {name: entry.folder for name, entry in TASKS.items()}
"""{task: folder of its scenario files and of the files that these name}."""
_FILE_SETTINGS = (("track", "csv"), ("cameras", "calibration"), ("vision", "file"))
MOST_BASES = 50
"""Greatest number of scenarios that extend each other in a row."""
MOST_ERRORS = 100
"""Greatest number of errors that are reported."""
MOST_NAMES = 10
"""Greatest number of names in a key path."""
RENAMED = {"train:paper": "train", "train:blind": "train:learned"}
"""{former name of a scenario of the package: its name}. Users' files and commands may still use the former name."""
FORMER_DEFAULTS = {"train": "train:guided"}
"""{scenario whose behaviour has changed: scenario that behaves as it did}."""
_LONGEST_ORIGIN = 500
"""Greatest length of an override in a message."""


def load_scenario(
    spec: str,
    seed: int | None = None,
    duration: float | None = None,
    overrides: Sequence[str] = (),
    allow_code: bool | None = None,
) -> Any:
    """Returns a scenario from a file, checked. Runs no code from the file.

    Args:
        spec: name of the scenario: "train", "train:interlaced", "path/to/file.yaml" or "path/to/file.yaml:name".
        seed: seed that replaces the scenario's; None keeps it.
        duration: duration that replaces the scenario's [s]; None keeps it.
        overrides: settings that replace the scenario's, each "key.path=value". The value is YAML; for example,
            "estimator=!AlphaBetaGamma" chooses a kind of estimator.
        allow_code: whether code that the file names (``!Custom``) may run when a diagram is built; None: if the user
            trusts the folder of the file, see `drake_tracker.scenarios.consent`. Code that an override names may run.

    Raises DrakeTrackerError, with one line per error: file and line or override, key path, what is allowed, value.
    Warns with `DrakeTrackerWarning` when the scenario has a new name, or a file rests on defaults that have changed.
    """
    path, name = _locate(_present_name(spec))
    entries = _read_file(path)
    name = name or _default_name(entries, path)

    def tree_on(replaced: Mapping[str, str], errors: list[str]) -> Value:
        notes: list[str] = []
        tree = _present(_resolve(entries, name, path, errors, replaced), notes)
        for override in overrides:
            tree = _present(_override(tree, override, origin_of(override), errors), notes)
        for note in () if replaced else notes:
            _warn(note)
        for key, value in (("seed", seed), ("duration", duration)):
            if value is not None:
                tree = merge(tree, nest(key, Value(value, f"--{key} {value}")))
        return tree

    errors: list[str] = []
    tree = tree_on({}, errors)
    scenario = _check(tree, errors)
    if path.parent not in PACKAGE_FOLDERS.values():
        _warn_of_new_defaults(scenario, path, name, tree_on)
    changes = {
        "name": scenario.name or (path.stem if name == path.stem else f"{path.stem}:{name}"),
        **_files(scenario, tree, path.parent),
        **_custom_parts(scenario, tree, path, allow_code),
    }
    return scenario.with_settings(changes)


def origin_of(override: str) -> str:
    """Returns how messages name an override of `load_scenario`."""
    text = f"--set {override}"
    return text if len(text) <= _LONGEST_ORIGIN else text[: _LONGEST_ORIGIN - 3] + "..."


def validate(scenario: BaseScenario) -> None:
    """Checks a scenario that was made or changed in Python. Raises DrakeTrackerError, with one line per error."""
    _check(tree_of(scenario, "scenario"), [])


def list_scenarios() -> list[tuple[str, str]]:
    """Returns (name, description) of all scenarios of the package, task by task."""
    return [(spec, load_scenario(spec).description) for spec in _packaged_names()]


def save_scenario(scenario: BaseScenario, path: Path | str) -> None:
    """Writes all settings of a scenario to a YAML file that `load_scenario` can read.

    Args:
        scenario: the scenario.
        path: file to write; its name without the suffix becomes the name of the scenario.
    """
    write_text(path, dump({Path(path).stem: plain(scenario)}))


def scenario_file(name: str) -> Path:
    """Returns the path of a file that a scenario names (``track.csv``, ``cameras.calibration``, ``vision.file``).

    Args:
        name: name of the file as in the scenario. `load_scenario` makes the paths of the user's files absolute; a name
            without a folder is a file of the package.
    """
    places = [folder / name for folder in PACKAGE_FOLDERS.values()]
    return next((place for place in places if is_file(place)), places[0])


def in_package(name: str) -> bool:
    """Returns whether a file that a scenario names belongs to the package."""
    return scenario_file(name).parent in PACKAGE_FOLDERS.values()


def _locate(spec: str) -> tuple[Path, str]:
    """Returns the scenario file and the name of the scenario in it, "" when ``spec`` does not contain one."""
    head, colon, tail = spec.rpartition(":")
    if colon and not tail:
        raise DrakeTrackerError(f"{spec} the name of a scenario is missing after the colon")
    file, name = (head, tail) if colon else (spec, "")
    if file.endswith((".yaml", ".yml")) or "/" in file:
        path = Path(file)
        if not is_file(path):
            raise DrakeTrackerError(f"there is no scenario file {file}")
        return path, name
    path = PACKAGE_FOLDERS.get(file, Path()) / f"{file}.yaml"
    if not is_file(path) or file not in _read_file(path):
        known = [known for known, _ in list_scenarios()]
        raise DrakeTrackerError(f"there is no scenario {spec!r}; allowed are {', '.join(known)}{_near(spec, known)}")
    return path, name


def _present_name(spec: str, origin: str = "") -> str:
    """Returns the present name of a packaged scenario. Warns if ``spec`` is a former one.

    Args:
        spec: name of the scenario.
        origin: where it was written, empty unless in a file.
    """
    if spec in RENAMED:
        _warn(f"{origin}{': ' if origin else ''}{spec} is now called {RENAMED[spec]}")
    return RENAMED.get(spec, spec)


def _warn_of_new_defaults(
    scenario: BaseScenario, path: Path, name: str, tree_on: Callable[[Mapping[str, str], list[str]], Value]
) -> None:
    """Warns when the scenario of a user's file was another one before the defaults of its task changed.

    Args:
        scenario: the scenario, as it is read now.
        path: path of the file.
        name: name of the scenario in the file.
        tree_on: returns its tree: ({scenario that the file extends: scenario to extend instead}, errors) -> tree.
    """
    if scenario.task not in FORMER_DEFAULTS:
        return
    errors: list[str] = []
    former = read(tree_on(FORMER_DEFAULTS, errors), TASKS[scenario.task].scenario, "", errors, {})
    if errors or former.with_settings({"description": scenario.description}) != scenario:
        _warn(
            f"{_label(path)}: {name} rests on the defaults of {scenario.task}, which have changed; write base: "
            f"{FORMER_DEFAULTS[scenario.task]} for the former ones"
        )


def _warn(line: str) -> None:
    warnings.warn(line, DrakeTrackerWarning, stacklevel=4)


def _label(path: Path) -> str:
    return path.name if path.parent in PACKAGE_FOLDERS.values() else str(path)


def _read_file(path: Path) -> dict[str, Value]:
    """Returns {name: tree} of the scenarios in a file; the caller must not change it."""
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise DrakeTrackerError(
            f"{_label(path)}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from None
    tree, problems = parse_file(text, _label(path))
    errors = list(problems)
    if tree is not None and not errors and not isinstance(tree.data, dict):
        errors.append(f"{_label(path)}: must be a mapping from names to scenarios")
    if tree is None or errors:
        raise DrakeTrackerError("\n".join(errors))
    return tree.data


def _default_name(entries: Mapping[str, Value], path: Path) -> str:
    if path.stem in entries:
        return path.stem
    if len(entries) != 1:
        raise DrakeTrackerError(f"{_label(path)}: add a colon and the name of a scenario: {', '.join(entries)}")
    return next(iter(entries))


def _resolve(
    entries: Mapping[str, Value],
    name: str,
    path: Path,
    errors: list[str],
    replaced: Mapping[str, str],
    above: tuple[str, ...] = (),
) -> Value:
    """Returns the tree of one scenario, merged with the scenarios that it extends.

    Args:
        entries: {name: tree} of the scenarios in the file.
        name: name of the scenario.
        path: path of the file.
        errors: list to which problems are appended, one line each.
        replaced: {task: scenario of the package that a file extends which names ``base: TASK``, or no base}.
        above: names of the scenarios of the file that extend this one, the last one directly.
    """
    if name not in entries:
        known = ", ".join(entries) + _near(name, entries)
        raise DrakeTrackerError(f"{_label(path)}: there is no scenario {name!r}; allowed are {known}")
    entry = entries[name]
    own = {} if entry.data is None else entry.data
    if not isinstance(own, dict):
        errors.append(f"{entry.origin}: scenario {name!r} must be a mapping of settings")
        own = {}
    settings = Value({key: value for key, value in own.items() if key != "base"}, entry.origin, entry.tag, True)
    if "base" not in own:
        task = own["task"].data if "task" in own else "train"
        if not (isinstance(task, str) and task in replaced):
            return settings
        former = _resolve_packaged(replaced[task], errors)
        return merge(_without_kinds(former, _present(settings, [])), settings)
    base, origin = own["base"].data, own["base"].origin
    above = (*above, name)
    if isinstance(base, str) and base in entries:
        if base in above:
            circle = ", ".join([*above[above.index(base) :], base])
            raise DrakeTrackerError(f"{origin}: base must not lead back to {base!r}: {circle} extend each other")
        if len(above) > MOST_BASES:
            raise DrakeTrackerError(f"{origin}: more than {MOST_BASES} scenarios extend each other in a row")
        return merge(_resolve(entries, base, path, errors, replaced, above), settings)
    packaged = _packaged_names()
    if isinstance(base, str) and base in replaced:
        base = replaced[base]
    elif isinstance(base, str):
        base = RENAMED.get(base, base) if replaced else _present_name(base, origin)
    if isinstance(base, str) and base in packaged:
        return merge(_resolve_packaged(base, errors), settings)
    others = ", ".join([*(other for other in entries if other not in above), *packaged])
    shown = repr(base) if isinstance(base, str) else "a list or mapping"
    near = _near(base, [*entries, *packaged]) if isinstance(base, str) else ""
    raise DrakeTrackerError(f"{origin}: base must be one of {others}, not {shown}{near}")


def _resolve_packaged(spec: str, errors: list[str]) -> Value:
    """Returns the tree of a scenario of the package, merged with the scenarios that it extends."""
    task, _, name = spec.partition(":")
    path = _package_file(task)
    return _resolve(_read_file(path), name or task, path, errors, {})


def _without_kinds(defaults: Value, over: Value) -> Value:
    """Returns the tree of a default scenario for a file that extends none.

    A part without a tag in such a file is of the first kind of its role, whatever kind the default scenario has.

    Args:
        defaults: tree of the default scenario.
        over: tree of the scenario in the file.
    """
    if not (isinstance(defaults.data, dict) and isinstance(over.data, dict)):
        return defaults
    data = {}
    for key, value in defaults.data.items():
        above = over.data.get(key)
        if above is None:
            data[key] = value
        elif value.tag is None or above.tag is not None:
            data[key] = _without_kinds(value, above)
    return Value(data, defaults.origin, defaults.tag, defaults.in_file, defaults.replaced)


def _package_file(task: str) -> Path:
    return PACKAGE_FOLDERS[task] / f"{task}.yaml"


def _packaged_names() -> list[str]:
    """Returns the names of all scenarios of the package, task by task."""
    return [task if name == task else f"{task}:{name}" for task in TASKS for name in _read_file(_package_file(task))]


def _near(name: str, names: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, list(names), n=1, cutoff=0.4)
    return f"; did you mean {close[0]}?" if close else ""


def _override(tree: Value, override: str, origin: str, errors: list[str]) -> Value:
    key, equals, text = override.partition("=")
    key = key.strip()
    if not equals or not all(key.split(".")) or key.count(".") >= MOST_NAMES:
        errors.append(f"{origin}: write it as key.path=value, for example --set track.speed=0.2")
        return tree
    schema = _schema(tree)
    if schema is not None and all(field.type is not str for field in fields_at(schema, key)):
        text = tag_kinds(text, schema)
    value = parse(text, lambda line: origin, errors)
    return tree if value is None else merge(tree, nest(key, value))


def _present(tree: Value, notes: list[str]) -> Value:
    """Returns a tree with former settings translated, see `BaseScenario.present`."""
    schema = _schema(tree)
    return tree if schema is None else schema.present(tree, notes)


def _schema(tree: Value) -> type[BaseScenario] | None:
    """Returns the class of the scenario of a tree; None if the tree names no task of the package."""
    task = tree.data.get("task")
    name = "train" if task is None else task.data
    return TASKS[name].scenario if isinstance(name, str) and name in TASKS else None


def _check(tree: Value, errors: list[str]) -> Any:
    """Returns the scenario of a tree. Raises DrakeTrackerError with the given errors and those found in the tree."""
    origins: dict[str, str] = {}
    task = tree.data.get("task")
    name = "train" if task is None else task.data
    if not isinstance(name, str) or name not in TASKS:
        errors.append(f"{task.origin}: task must be one of {', '.join(TASKS)}, not {name!r}{_near(str(name), TASKS)}")
        raise DrakeTrackerError("\n".join(errors))
    scenario = read(tree, TASKS[name].scenario, "", errors, origins)
    scenario = dataclasses.replace(scenario, origins=origins)
    if not errors:  # settings can be compared with each other only when all of them could be read
        errors += [f"{scenario.where(key)} {problem}" for key, problem in scenario.problems()]
    if errors:
        more = [f"and {len(errors) - MOST_ERRORS} more errors"] if len(errors) > MOST_ERRORS else []
        raise DrakeTrackerError("\n".join([*errors[:MOST_ERRORS], *more]))
    return scenario


def _files(scenario: BaseScenario, tree: Value, folder: Path) -> dict[str, str]:
    """Returns {key path: absolute path} of the user's files that a scenario names.

    A file is searched for in the folder of the scenario file or, when an override names it, in the current folder.
    """
    found = {}
    for part, name in _FILE_SETTINGS:
        text = getattr(getattr(scenario, part, None), name, "")  # only measured vision has a file
        if not text:
            continue
        key = f"{part}.{name}"
        file = (Path.cwd() if _is_override(tree, key) else folder) / text
        if is_file(file) and file.parent not in PACKAGE_FOLDERS.values():
            found[key] = str(file.resolve())
        elif is_file(scenario_file(text)):
            continue
        elif name == "calibration":  # the command ``calibrate`` may be about to write it
            found[key] = str(file.resolve())
        else:
            raise DrakeTrackerError(f"{scenario.where(key)}: there is no file {file}")
    return found


def _custom_parts(scenario: BaseScenario, tree: Value, path: Path, allow_code: bool | None) -> dict[str, Custom]:
    """Returns {key path: custom part}, with the folder of its module, and with whether a file names it.

    Worker processes and later runs find the module in that folder. Nothing is imported.
    """
    found = {}
    for field in settings_of(scenario):
        part = getattr(scenario, field.name)
        if not isinstance(part, Custom):
            continue
        folders = [path.parent, Path.cwd()]
        if _is_override(tree, f"{field.name}.call"):
            folders.reverse()
        if part.folder:  # set by the user, or by an earlier run, perhaps on another machine
            folders.insert(0, path.parent / part.folder)
        written = (tree.find(f"{field.name}.{name}") for name in ("call", "folder"))  # both decide which code it is
        in_file = next((value for value in written if value is not None and value.in_file and value.data), None)
        found[field.name] = dataclasses.replace(
            part,
            folder=find_module(part, folders) or part.folder,
            named_at=in_file.origin if in_file is not None else "",
            allowed=in_file is None or (is_trusted(path) if allow_code is None else allow_code),
        )
    return found


def _is_override(tree: Value, key: str) -> bool:
    """Returns whether a setting got its value from an override, rather than from a file or by default."""
    value = tree.find(key)
    return value is not None and not value.in_file
