"""Draws the ``.. pydrake_system::`` blocks of docstrings: a System as a box, its inputs to the left, its outputs to the
right. The directive ``systems`` documents every System and Diagram of a folder of the package, ``messages`` the fields
of every message.
"""

import ast
import html
import importlib
import inspect
import re
from pathlib import Path

import yaml
from docutils import nodes
from sphinx.util.docutils import SphinxDirective

PACKAGE = Path(__file__).parents[2] / "drake_tracker"
BLOCK = ".. pydrake_system::"


class PydrakeSystem(SphinxDirective):
    """The block of one System: YAML with name, input_ports, output_ports."""

    has_content = True

    def run(self):
        block = yaml.safe_load("\n".join(self.content))
        inputs, outputs = (block.get(f"{way}_ports") or [] for way in ("input", "output"))
        return [nodes.raw("", draw(block["name"], inputs, outputs), format="html")]


def draw(name, inputs, outputs):
    """Returns the HTML of a System's box."""

    def ports(names, way):
        return f'<ul class="{way}">{"".join(f"<li>{html.escape(str(port))}</li>" for port in names)}</ul>'

    return (
        f'<div class="pydrake-system">{ports(inputs, "inputs")}<span class="name">{html.escape(name)}</span>'
        f"{ports(outputs, 'outputs')}</div>"
    )


class Systems(SphinxDirective):
    """Every class with a ``pydrake_system`` block in a folder of the package, module by module."""

    required_arguments = 1

    def run(self):
        lines = []
        for path in sorted(path for path in PACKAGE.rglob("*.py") if path.parent.name == self.arguments[0]):
            self.env.note_dependency(str(path))
            for name in systems_in(path):
                module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
                lines += [f"{name}", "-" * len(name), "", f".. autoclass:: {module}.{name}", ""]
        if not lines:
            raise self.error(f"drake_tracker/{self.arguments[0]} has no Systems")
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def systems_in(path):
    """Returns the names of the classes of a module whose docstrings have a ``pydrake_system`` block."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    return [node.name for node in classes if BLOCK in (ast.get_docstring(node) or "")]


class Messages(SphinxDirective):
    """The fields of every message between the rooms, and the text that stands below it in the code."""

    def run(self):
        path = PACKAGE / "core" / "messages.py"
        self.env.note_dependency(str(path))
        lines = []
        for name, fields, text in messages_in(path):
            listed = ", ".join(f"``{field}``" for field in fields)
            lines += [name, "-" * len(name), "", listed, "", *text.splitlines(), ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def messages_in(path):
    """Yields (name, fields, text) of the named views of a module. Of more than 20 fields the first ten are given."""
    module = importlib.import_module(f"drake_tracker.core.{path.stem}")
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for node, below in zip(body, body[1:]):
        if isinstance(node, ast.Assign) and "namedview(" in ast.unparse(node.value):
            name = node.targets[0].id
            fields = getattr(module, name).get_fields()
            yield name, fields if len(fields) <= 20 else (*fields[:10], "…"), inspect.cleandoc(below.value.value)


def part_parameters(app, what, name, obj, options, lines):
    """Gives each parameter a line of its own, where a docstring tells of several in one: napoleon wants them so."""
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
    app.connect("autodoc-process-docstring", part_parameters, priority=400)  # before napoleon's own
    app.add_directive("pydrake_system", PydrakeSystem)
    app.add_directive("systems", Systems)
    app.add_directive("messages", Messages)
    app.add_css_file("pydrake_system.css")
    return {"parallel_read_safe": True}
