"""Draws the diagrams of the documentation: the subsystems as built, the time slots, and the drawings in diagrams/.

    python docs/make_diagrams.py     needs the program dot (Debian: apt-get install graphviz)

The diagrams of the subsystems are generated from the built Drake Diagrams and omit unconnected ports. Drake's own graph
(`drake-tracker run --graphviz`) shows those, too.
"""

import html
import json
import re
import subprocess
from itertools import zip_longest
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from pydrake.systems.framework import InputPortIndex, OutputPortIndex

from drake_tracker import load_scenario, make_diagram
from drake_tracker.core.timing import (
    ESTIMATOR_SLOT,
    GRASP_SLOT,
    GUARD_SLOT,
    IK_SLOT,
    LIMITER_SLOT,
    LINK_SLOT,
    REFLEX_SLOT,
    SERVO_PERIOD,
    SERVO_SLOT,
    TIME_STEP,
    TRANSFORM_SLOT,
    VISION_PERIOD,
    servo_slot,
    vision_slot,
)
from drake_tracker.tasks.style import FAR_PREDICTED, HAND, INK, PLOT_STYLE, PREDICTED, RULE, SOFT_INK

DRAWN = Path(__file__).parent / "diagrams"
IMAGES = Path(__file__).parent / "images"
FONT = "Liberation Sans"
"""Font for which dot computes the layout (Debian: apt-get install fonts-liberation)."""
SHOWN_FONTS = "Helvetica,Arial,Liberation Sans,sans-serif"
"""Fonts in the SVG; the first three have the same metrics. In any other font a label is scaled to its width."""
SUBSYSTEMS = ("world", "vision", "arm")
"""Subsystems that consist of several Systems."""
SHOWN = 0.060
"""Time span of the figure of the slots [s]."""
SLOTS = 16
"""Slots are multiples of this fraction of a plant step."""
RHYTHM = (
    ("plant", 0.0, TIME_STEP, INK),
    ("images, centroids", 0.0, VISION_PERIOD, PREDICTED),
    ("estimator", vision_slot(ESTIMATOR_SLOT), VISION_PERIOD, PREDICTED),
    ("link", vision_slot(LINK_SLOT), VISION_PERIOD, PREDICTED),
    ("packet guard", vision_slot(GUARD_SLOT), VISION_PERIOD, HAND),
    ("collision reflex", REFLEX_SLOT * TIME_STEP, TIME_STEP, HAND),
    ("servo", servo_slot(SERVO_SLOT), SERVO_PERIOD, HAND),
    ("grasp machine", servo_slot(GRASP_SLOT), SERVO_PERIOD, HAND),
    ("transform equation", servo_slot(TRANSFORM_SLOT), SERVO_PERIOD, HAND),
    ("inverse kinematics", servo_slot(IK_SLOT), SERVO_PERIOD, HAND),
    ("joint limiter", servo_slot(LIMITER_SLOT), SERVO_PERIOD, HAND),
)
"""When each part updates: name, offset [s], period [s], colour."""


def graphs(scenario="train"):
    """Returns {name of the picture: Graphviz text} of a scenario's diagram and its subsystems."""
    in_process = "cameras.render_processes=0" if scenario.startswith("train") else "camera.render_processes=0"
    hand_eye = make_diagram(load_scenario(scenario, overrides=[in_process]))
    systems = {"hand_eye": hand_eye} | {name: hand_eye.GetSubsystemByName(name) for name in SUBSYSTEMS}
    return {name: graph_of(system) for name, system in systems.items()}


def graph_of(diagram):
    """Returns the Graphviz text of a Diagram: its Systems with their connected ports."""
    edges, ports = [], {system: (set(), set()) for system in diagram.GetSystems()}

    def end(system, index, way):
        ports[system][way].add(int(index))
        return f'"{system.get_name()}":{"io"[way]}{int(index)}'

    for (reader, i), (source, o) in diagram.connection_map().items():
        edges.append(f"{end(source, o, 1)}:e -> {end(reader, i, 0)}:w")
    for k in range(diagram.num_input_ports()):
        name = diagram.get_input_port(k).get_name()
        edges.append(f'"in {name}" [label="{name}", shape=plain, fontcolor="{PREDICTED}"]')
        for reader, i in diagram.GetInputPortLocators(InputPortIndex(k)):
            edges.append(f'"in {name}":e -> {end(reader, i, 0)}:w [color="{PREDICTED}"]')
    for k in range(diagram.num_output_ports()):
        name = diagram.get_output_port(k).get_name()
        colour = FAR_PREDICTED if name.startswith("truth_") else HAND
        source, o = diagram.get_output_port_locator(OutputPortIndex(k))
        edges.append(f'"out {name}" [label="{name}", shape=plain, fontcolor="{colour}"]')
        edges.append(f'{end(source, o, 1)}:e -> "out {name}":w [color="{colour}"]')
    outputs = " ".join(f'"out {diagram.get_output_port(k).get_name()}"' for k in range(diagram.num_output_ports()))
    nodes = [f'"{system.get_name()}" [label=<{box(system, *used)}>]' for system, used in ports.items()]
    style = "rankdir=LR ranksep=0.45 nodesep=0.12 node [shape=plain fontsize=12] edge [arrowsize=0.6]"
    return "\n".join(["digraph {", style, *nodes, *edges, f"{{rank=sink {outputs}}}", "}"])


def box(system, inputs, outputs):
    """Returns the label of a System: its class and name above, input ports to the left, output ports to the right."""
    title = f"<B>{type(system).__name__.removesuffix('_[float]')}</B><BR/>{system.get_name()}"
    sides = [
        [f'<TD PORT="i{k}" ALIGN="LEFT">{system.get_input_port(k).get_name()}</TD>' for k in sorted(inputs)],
        [f'<TD PORT="o{k}" ALIGN="RIGHT">{system.get_output_port(k).get_name()}</TD>' for k in sorted(outputs)],
    ]
    rows = [f"<TR>{left}{right}</TR>" for left, right in zip_longest(*sides, fillvalue="<TD></TD>")]
    frame = f'BORDER="1" COLOR="{SOFT_INK}" CELLBORDER="0" CELLSPACING="0" CELLPADDING="4" STYLE="ROUNDED"'
    return f'<TABLE {frame}><TR><TD COLSPAN="2" CELLPADDING="6">{title}</TD></TR><HR/>{"".join(rows)}</TABLE>'


def draw_graph(graph):
    """Returns the SVG text of a Graphviz text. Every label has a fixed width, so that it fits its box in any font."""
    widths = label_widths(json.loads(run_dot(graph, "json")))

    def fixed(match):
        x, text = float(match[1]), match[2]
        width = min(widths[html.unescape(text)], key=lambda place: abs(place[0] - x))[1]
        return f'{match[0][: -1 - len(text)]} textLength="{width:g}" lengthAdjust="spacingAndGlyphs">{text}'

    svg = re.sub(r"<!--.*?-->\n?|<title>.*?</title>\n?", "", run_dot(graph, "svg"), flags=re.DOTALL)
    svg = re.sub(r'font-family="[^"]*"', f'font-family="{SHOWN_FONTS}"', svg)
    return re.sub(r'<text [^>]*?\bx="([-\d.]+)"[^>]*>([^<]+)', fixed, svg)


def run_dot(graph, form):
    fonts = [f"-{part}fontname={FONT}" for part in "GNE"]
    command = ["dot", f"-T{form}", "-Gbgcolor=white", *fonts]
    return subprocess.run(command, input=graph, capture_output=True, text=True, check=True).stdout


def label_widths(layout):
    """Returns {text: [(x, width)]} of every piece of text in a layout, as dot's JSON describes it."""
    widths = {}
    parts = [layout, *layout.get("objects", ()), *layout.get("edges", ())]
    for part in parts:
        for operation in part.get("_ldraw_", ()):
            if operation["op"] == "T":
                widths.setdefault(operation["text"].strip(), []).append((operation["pt"][0], operation["width"]))
                widths.setdefault(operation["text"], []).append((operation["pt"][0], operation["width"]))
    return widths


def draw_slots():
    """Returns the figure of the update times over two servo periods, and of the slots in a plant step."""
    with matplotlib.rc_context(PLOT_STYLE | {"svg.fonttype": "none", "svg.hashsalt": "slots"}):
        figure, (whole, step) = plt.subplots(
            1, 2, figsize=(10.5, 3.4), sharey=True, width_ratios=(3, 2), layout="constrained"
        )
        for row, (_, offset, period, colour) in enumerate(RHYTHM):
            times = 1e3 * np.arange(offset, SHOWN + 1e-9, period)
            slot = round(SLOTS * offset / TIME_STEP, 6) % SLOTS
            for axis, shown in ((whole, times), (step, np.array([slot]))):
                axis.axhline(row, color=RULE, linewidth=0.6, zorder=0)
                axis.plot(shown, np.full(len(shown), row), "o", color=colour, markersize=5)
        whole.set(xlim=(-0.7, 1e3 * SHOWN + 0.7), xlabel="time [ms]", title="Two periods of the servo")
        whole.set_yticks(range(len(RHYTHM)), [name for name, *_ in RHYTHM])
        whole.invert_yaxis()
        step.set(xlim=(-0.5, SLOTS), xlabel=f"slot [1/{SLOTS} of a plant step]", title="Within a plant step")
        step.set_xticks(range(0, SLOTS + 1, 4))
        return figure


def main():
    for name, graph in (graphs() | {path.stem: path.read_text() for path in sorted(DRAWN.glob("*.dot"))}).items():
        (IMAGES / f"{name}.svg").write_text(draw_graph(graph), encoding="utf-8")
    draw_slots().savefig(IMAGES / "slots.svg", metadata={"Date": None})
    for path in sorted(IMAGES.glob("*.svg")):
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
