"""Reference pages that are generated from the package.

- ``systems:: FOLDER`` documents every System and Diagram in a folder of the package and in those below.
- ``exports:: PACKAGE`` documents what a package and those below it export, apart from their Systems.
- ``messages::`` lists the fields of every message.
- ``settings:: TASK`` lists every setting of a task's scenario, kind by kind.
- ``options:: COMMAND`` lists the arguments and options of a command of ``drake-tracker``.
"""

import argparse
import ast
import dataclasses
import importlib
import inspect
import re
from pathlib import Path

from sphinx.util.docutils import SphinxDirective

from drake_tracker import cli
from drake_tracker.core.setting import key_of, kinds_of, list_kinds, settings_of
from drake_tracker.scenarios.base import Custom
from drake_tracker.scenarios.reader import describe_settings, summary_of

PACKAGE = Path(__file__).parents[2] / "drake_tracker"
BLOCK = ".. pydrake_system::"
EXPORT = re.compile(r"^from \.([\w.]+) import (\w+) as \w+", re.MULTILINE)
OPTION = re.compile(r"(--[\w-]+)")
SHOWN_FIELDS = 20
"""Fields of a message that are listed; of a longer message, the first ten are."""


class Systems(SphinxDirective):
    """Every class with a ``pydrake_system`` block in a folder of the package and in those below, module by module."""

    required_arguments = 1

    def run(self):
        lines = []
        for path in sorted((PACKAGE / self.arguments[0]).rglob("*.py")):
            self.env.note_dependency(str(path))
            for name in systems_in(path):
                lines += [f"{name}", "-" * len(name), "", f".. autoclass:: {module_of(path)}.{name}", ""]
        if not lines:
            raise self.error(f"drake_tracker/{self.arguments[0]} has no Systems")
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


class Exports(SphinxDirective):
    """The public names of a package and of those below it, as their ``__init__.pyi`` list them."""

    required_arguments = 1

    def run(self):
        lines = ["Other public names", "------------------", ""]
        for stub in sorted((PACKAGE / self.arguments[0]).rglob("__init__.pyi")):
            self.env.note_dependency(str(stub))
            for module, name in EXPORT.findall(stub.read_text(encoding="utf-8")):
                path = stub.parent.joinpath(*module.split(".")).with_suffix(".py")
                if not (path.is_file() and name in systems_in(path)):
                    lines += [*documented(module_of(path), name), ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True) if len(lines) > 3 else []


class Messages(SphinxDirective):
    """The fields of every message between the subsystems, and the text that stands below it in the code."""

    def run(self):
        path = PACKAGE / "core" / "messages.py"
        self.env.note_dependency(str(path))
        lines = []
        for name, fields, text in messages_in(path):
            listed = ", ".join(f"``{field}``" for field in fields)
            lines += [name, "-" * len(name), "", listed, "", *text.splitlines(), ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


class Settings(SphinxDirective):
    """The settings of a task: a table for each group, and one for each kind of a role."""

    required_arguments = 1

    def run(self):
        from drake_tracker.tasks import load_scenario

        scenario = load_scenario(self.arguments[0])
        self.env.note_dependency(str(PACKAGE / "tasks" / self.arguments[0] / "scenario.py"))
        all_rows = describe_settings(scenario)
        sections, texts = {"Run": []}, {}
        for field in settings_of(scenario):
            value = getattr(scenario, field.name)
            name = key_of(field)
            kinds = [kind for kind in kinds_of(field.type) if dataclasses.is_dataclass(kind)]
            listed = list_kinds(field.type)
            if listed:
                sections[name] = [row for row in all_rows if row[0] == name]
                for kind in listed:
                    title = f"{name}: !{kind.__name__}"
                    sections[title] = describe_settings(kind(), f"{name}[i].")
                    texts[title] = summary_of(kind)
            elif not kinds:
                sections["Run"] += [row for row in all_rows if row[0] == name]
            elif len(kinds) == 1:
                sections[name] = describe_settings(value, f"{name}.")
            else:
                for kind in kinds:
                    default = " (default)" if kind is type(value) else ""
                    rows = custom_rows(name) if kind is Custom else None
                    part = value if default else kind()
                    sections[f"{name}: !{kind.__name__}{default}"] = rows or describe_settings(part, f"{name}.")
        lines = []
        for title, rows in sections.items():
            lines += [title, "-" * len(title), "", *([texts[title], ""] if title in texts else [])]
            lines += [*(table(rows) if rows else ["No settings."]), ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


class Options(SphinxDirective):
    """The arguments and options of a command."""

    required_arguments = 1

    def run(self):
        (commands,) = (each for each in cli.make_parser()._actions if isinstance(each, argparse._SubParsersAction))
        command = commands.choices[self.arguments[0]]
        self.env.note_dependency(str(PACKAGE / "commands"))
        lines = [".. list-table::", "   :widths: 35 65", ""]
        for action in command._actions:
            if "--help" not in action.option_strings:
                value = f" {action.metavar}" if isinstance(action.metavar, str) and action.option_strings else ""
                shown = ", ".join(action.option_strings) or action.metavar or action.dest
                text = OPTION.sub(r"``\1``", escape(action.help or ""))
                lines += [f"   * - ``{shown}{value}``", f"     - {text}"]
        return self.parse_text_to_nodes("\n".join(lines))


def module_of(path):
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)


def systems_in(path):
    """Returns the names of the classes of a module whose docstrings have a ``pydrake_system`` block."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    return [node.name for node in classes if BLOCK in (ast.get_docstring(node) or "")]


def documented(module, name):
    """Returns the autodoc directive of one exported name."""
    value = getattr(importlib.import_module(module), name)
    if inspect.isclass(value):
        kind = "autoexception" if issubclass(value, Exception) else "autoclass"
        plain = dataclasses.is_dataclass(value) or issubclass(value, (tuple, Exception))
        members = [] if plain else ["   :members:"]
        return [f".. {kind}:: {module}.{name}", *members]
    return [f".. {'autofunction' if callable(value) else 'autodata'}:: {module}.{name}"]


def messages_in(path):
    """Yields (name, fields, text) of the named views of a module. Of a long message the first ten fields are given."""
    module = importlib.import_module(f"drake_tracker.core.{path.stem}")
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for node, below in zip(body, body[1:]):
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value and "namedview(" in ast.unparse(node.value):
            name = (node.targets[0] if isinstance(node, ast.Assign) else node.target).id
            fields = getattr(module, name).get_fields()
            shown = fields if len(fields) <= SHOWN_FIELDS else (*fields[:10], "…")
            yield name, shown, inspect.cleandoc(below.value.value)


def custom_rows(name):
    """Returns the rows of a custom part, whose parameters are those of the user's class."""
    kinds = {"call": "text", "parameters": "a mapping", "folder": "text"}
    return [(f"{name}.{field.name}", "", kinds[field.name], field.metadata["help"]) for field in settings_of(Custom)]


def table(rows):
    """Returns the lines of a table of (key path, default, allowed, meaning)."""
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 26 16 26 32", ""]
    for row in (("setting", "default", "allowed", "meaning"), *rows):
        key, value, allowed, meaning = (escape(cell) for cell in row)
        first = (key, value) if row[0] == "setting" else (f"``{row[0]}``", f"``{row[1]}``" if row[1].strip() else "")
        lines += [f"   * - {first[0]}", f"     - {first[1]}", f"     - {allowed}", f"     - {meaning}"]
    return lines


def escape(text):
    """Returns plain text as reStructuredText."""
    return re.sub(r"([\\*`|_])", r"\\\1", str(text)).replace("%%", "%")


def separate_parameters(app, what, name, obj, options, lines):
    """Gives each parameter a line of its own where a docstring describes several in one: napoleon needs that."""
    try:
        names = "|".join(inspect.signature(obj).parameters)
    except (TypeError, ValueError):
        return
    if "Args:" in lines and names:
        first = lines.index("Args:") + 1
        indent = re.match(" *", lines[first])[0]
        text = "\n".join(lines[first:])
        lines[first:] = re.sub(rf"(?<=\.) (?=(?:{names}): )", f"\n{indent}", text).split("\n")


def setup(app):
    app.connect("autodoc-process-docstring", separate_parameters, priority=400)  # before napoleon
    for name, directive in {
        "systems": Systems,
        "exports": Exports,
        "messages": Messages,
        "settings": Settings,
        "options": Options,
    }.items():
        app.add_directive(name, directive)
    return {"parallel_read_safe": True}
