"""Draws the ``.. pydrake_system::`` blocks of docstrings: a box with inputs to the left and outputs to the right."""

import html

import yaml
from docutils import nodes
from sphinx.util.docutils import SphinxDirective


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


def setup(app):
    app.add_directive("pydrake_system", PydrakeSystem)
    app.add_css_file("pydrake_system.css")
    return {"parallel_read_safe": True}
