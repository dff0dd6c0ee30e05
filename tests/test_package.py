"""The rules that hold for every module of the package, and the files that it needs."""

import ast
import importlib.util
import re
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import drake_tracker.core.errors
from drake_tracker.core import system_check as machine
from drake_tracker.core.models_path import models_path

PACKAGE = Path(drake_tracker.core.errors.__file__).parents[1]
REPOSITORY = PACKAGE.parent
MODULES = sorted(PACKAGE.rglob("*.py"))
SCRIPTS = sorted(path for folder in ("benchmarks", "docs", "models") for path in (REPOSITORY / folder).rglob("*.py"))
SUBSYSTEMS = (
    *("core", "cameras", "world", "vision", "measured", "estimation", "dispatch", "link", "arm", "grasp", "footage"),
    *("network", "faults"),
)
TASKS = ("scenarios", "diagrams", "tasks")
APPLICATIONS = (
    *("run", "replay", "live", "report", "campaign", "calibration", "own_cameras", "figures", "environments"),
    *("commands", "cli", "__main__", "__init__"),
)
CONTROLLER = ("cameras", "vision", "measured", "estimation", "dispatch", "link", "arm", "grasp", "network")
FORBIDDEN = {
    **dict.fromkeys(SUBSYSTEMS, (*TASKS, *APPLICATIONS)),
    **dict.fromkeys(TASKS, APPLICATIONS),
    "core": (*SUBSYSTEMS[1:], *TASKS, *APPLICATIONS),
    "arm": ("grasp", *TASKS, *APPLICATIONS),
    "scenarios": (*SUBSYSTEMS[1:], "diagrams", "tasks", *APPLICATIONS),
    "diagrams": ("tasks", *APPLICATIONS),
}
"""Packages that a package must not import."""
ASSEMBLIES = {
    *("arm/motion/set_point_spline_system.py", "arm/motion/tool_controller.py"),
    *(
        "world/imaging/camera_system.py",
        "world/imaging/cameras.py",
        "world/imaging/calibration_board.py",
        "world/imaging/wrist_calibration_scene.py",
        "world/train/plant.py",
        "world/conveyor/conveyor_plant.py",
        "world/imaging/scene_copy.py",
        "world/ball/ball_plant.py",
    ),
}
"""Modules that put Drake's own Systems together."""
DEFINITIONS = (ast.Import, ast.ImportFrom, ast.FunctionDef, ast.ClassDef, ast.Assign, ast.AnnAssign)


def relative(path):
    return path.relative_to(PACKAGE).as_posix()


def imports_of(path):
    """Every module that a file imports, the imported names as well, as they may be modules."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{relative(path)} line {node.lineno}: import by the full name"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def module_name(path):
    parts = path.relative_to(REPOSITORY).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def in_child(code, cwd):
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=cwd, check=False)
    assert child.returncode == 0, child.stderr
    return child.stdout


def is_arithmetic(path):
    return (
        relative(path).split("/")[0] in SUBSYSTEMS
        and not path.stem.endswith(("_system", "_diagram"))
        and relative(path) not in ASSEMBLIES
    )


@pytest.mark.parametrize("path", list(filter(is_arithmetic, MODULES)), ids=relative)
def test_arithmetic_imports_no_systems(path):
    for name in imports_of(path):
        assert not name.startswith("pydrake.systems"), f"move the System to {path.stem}_system.py"


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_no_module_imports_everything(path):
    for name in imports_of(path):
        assert not name.startswith("pydrake.all"), "pydrake.all shadows abs, all, max, min, pow"
        assert not name.endswith(".*"), "import names"


@pytest.mark.parametrize("subsystem", CONTROLLER)
def test_no_subsystem_of_the_controller_imports_the_world(subsystem):
    for path in (PACKAGE / subsystem).rglob("*.py"):
        for name in imports_of(path):
            assert not name.startswith("drake_tracker.world"), f"{relative(path)}: ground truth stays in the world"


@pytest.mark.parametrize("subsystem", CONTROLLER)
def test_no_subsystem_of_the_controller_imports_the_faults(subsystem):
    for path in (PACKAGE / subsystem).rglob("*.py"):
        for name in imports_of(path):
            assert not name.startswith("drake_tracker.faults"), (
                f"{relative(path)}: the controller must notice by itself"
            )


def test_the_top_level_holds_only_the_three_layers():
    names = {
        path.stem if path.suffix == ".py" else path.name for path in PACKAGE.iterdir() if path.name != "__pycache__"
    }
    assert names - {"__init__.pyi", "py.typed"} == {*SUBSYSTEMS, *TASKS, *APPLICATIONS}


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_no_module_imports_from_a_higher_layer(path):
    own = relative(path).removesuffix(".py").split("/")[0]
    for name in imports_of(path):
        parts = name.split(".")
        if parts[0] == "drake_tracker" and len(parts) > 1:
            assert parts[1] not in FORBIDDEN.get(own, ()), f"{own} must not import {name}"


def test_packages_import_each_other_in_one_direction_only():
    imports = {}
    for path in MODULES:
        own = relative(path).removesuffix(".py").split("/")[0]
        others = {name.split(".")[1] for name in imports_of(path) if name.startswith("drake_tracker.")}
        imports.setdefault(own, set()).update(others - {own})
    mutual = {(a, b) for a in imports for b in imports[a] & imports.keys() if a in imports[b]}
    assert not mutual


PACKAGES = sorted(path.parent for path in MODULES if path.name == "__init__.py" and path.parent.name != "commands")


@pytest.mark.parametrize("folder", PACKAGES, ids=relative)
def test_every_package_exports_what_its_stub_lists(folder):
    if not (folder / "__init__.pyi").exists():
        pytest.fail(f"{relative(folder)} has no __init__.pyi that lists its exports")
    module = importlib.import_module(module_name(folder / "__init__.py"))
    assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    for name in module.__all__:
        assert getattr(module, name) is not None


def test_every_frozen_state_shares_the_base():
    copies = [relative(path) for path in MODULES if "__deepcopy__" in path.read_text(encoding="utf-8")]
    assert copies == ["core/frozen_state.py"]


def test_every_named_view_is_in_one_module():
    assert [relative(path) for path in MODULES if "namedview(" in path.read_text(encoding="utf-8")] == [
        "core/messages.py"
    ]


def annotated(function):
    arguments = function.args
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    missing = [argument.arg for argument in named if argument and not argument.annotation]
    return function.returns is not None and missing in ([], ["self"], ["cls"])


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_every_function_is_annotated(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            assert annotated(node), f"line {node.lineno}: {node.name}"


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_a_module_only_defines(path):
    """At the top of a module stand its docstring, imports, definitions, constants (made read-only), the main guard."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in tree.body:
        allowed = isinstance(node, DEFINITIONS)
        documents = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        guard = isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "__name__ == '__main__'")
        freezes = isinstance(node, ast.For) and ".setflags(write=False)" in ast.unparse(node)
        where = f"{relative(path)} line {node.lineno}"
        assert allowed or documents or guard or freezes, f"{where}: {ast.unparse(node)[:60]}"
    assert ast.get_docstring(tree) or not tree.body, f"{relative(path)}: a module says what it is"


def test_every_module_imports_and_nothing_happens(tmp_path):
    names = [module_name(path) for path in MODULES]
    code = (
        f"import importlib, threading\nfor name in {names!r}: importlib.import_module(name)\n"
        "print(threading.active_count())"
    )
    assert in_child(code, tmp_path).split() == ["1"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.relative_to(REPOSITORY).as_posix())
def test_what_benchmarks_and_documents_import_of_the_package_is_there(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("drake_tracker"):
            module = importlib.import_module(node.module)
            for alias in node.names:
                found = hasattr(module, alias.name) or importlib.util.find_spec(f"{node.module}.{alias.name}")
                assert found, f"line {node.lineno}: {node.module} has no {alias.name}"


def test_the_command_line_starts_without_drake(tmp_path):
    code = (
        "import sys, drake_tracker.cli\n"
        "print(*[name for name in ('pydrake', 'numpy', 'cv2', 'matplotlib') if name in sys.modules])"
    )
    assert in_child(code, tmp_path).split() == []


@pytest.mark.parametrize("before", ["", "import drake_tracker.run.simulation\n"])
def test_the_public_names_are_callable_in_whatever_order_modules_were_imported(tmp_path, before):
    """`simulate` is a function and a module of the package."""
    code = before + (
        "from drake_tracker import load_scenario, make_diagram, simulate\n"
        "from drake_tracker import simulate as again\n"
        "print(*[callable(name) for name in (load_scenario, make_diagram, simulate, again)])"
    )
    assert in_child(code, tmp_path).split() == ["True"] * 4


def test_models_are_found_and_name_their_package():
    root = ElementTree.parse(models_path() / "package.xml").getroot()
    assert root.findtext("name")
    assert models_path() == REPOSITORY / "models"


def test_models_in_an_installed_package(tmp_path, monkeypatch):
    from drake_tracker.core import models_path as module

    monkeypatch.setattr(module, "_PACKAGE", tmp_path / "site-packages" / "drake_tracker")
    with pytest.raises(drake_tracker.core.errors.DrakeTrackerError, match="models are missing"):
        module.models_path()
    inside = tmp_path / "site-packages" / "drake_tracker" / "models"
    inside.mkdir(parents=True)
    (inside / "package.xml").write_text("<package><name>x</name></package>")
    assert module.models_path() == inside


def test_every_requirement_is_pinned_and_the_pins_name_no_host():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = (REPOSITORY / "constraints.txt").read_text(encoding="utf-8").split("\n")
    pinned = set()
    for line in filter(None, lines):
        match = re.fullmatch(r"([a-z0-9-]+)==[0-9.]+(b[0-9]+)?( ; .*)?", line)
        assert match, f"not a pinned version: {line}"
        pinned.add(match[1])
    extras = [name for extra in project["optional-dependencies"].values() for name in extra]
    for requirement in project["dependencies"] + extras:
        name = re.match(r"[A-Za-z0-9-]+", requirement)[0]
        assert name in pinned or name == project["name"], requirement


def test_make_setup_and_the_doctor_name_the_same_libraries():
    makefile = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
    for package in ("libglib2.0-0", "libegl1", "libgl1-mesa-dri"):
        assert package in makefile and package in machine.APT_LINE
