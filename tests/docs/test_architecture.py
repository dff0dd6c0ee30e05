"""The parts that ARCHITECTURE.md names for the default run are those that it executes, with rendered cameras."""

import importlib
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram

import drake_tracker
from drake_tracker import load_scenario, make_diagram

ARCHITECTURE = Path(__file__).parents[2] / "ARCHITECTURE.md"
PACKAGE = Path(drake_tracker.__file__).parent
POINTER = re.compile(r"`([\w/]+\.py)::([\w.]+)`")
DURATION = 1.0
"""Simulated time [s]; the last part to begin is the filter of the servo, after 0.93 s."""
SUBSYSTEMS = ["world", "vision", "host", "link", "arm"]
SERVO_SIDE = ["guard", "servo", "grasp machine", "transform equation"]
JOINT_SIDE = ["inverse kinematics", "joint limiter", "spline", "reflex"]


def rows():
    """{first cell: pointers of the row} of the tables in the section on the data flow."""
    section = ARCHITECTURE.read_text(encoding="utf-8").split("\n## Data flow\n")[1].split("\n## ")[0]
    cells = [line.split(" | ")[0].strip("| ") for line in section.splitlines() if line.startswith("|")]
    pointers = [POINTER.findall(line) for line in section.splitlines() if line.startswith("|")]
    return {cell: found for cell, found in zip(cells, pointers) if found}


POINTERS = [pointer for found in rows().values() for pointer in found]


@dataclass
class Executed:
    """A run: its Systems, and (file, qualified name) of each function of the package that was called in it."""

    systems: list
    functions: set

    def has(self, file, name):
        """Whether the run called a function of this name; of a Diagram, which has none, whether it was simulated."""
        named = getattr(importlib.import_module(f"drake_tracker.{file[:-3].replace('/', '.')}"), name)
        if isinstance(named, type) and issubclass(named, Diagram):
            return any(isinstance(system, named) for system in self.systems)
        return any(where == file and f"{called}.".startswith(f"{name}.") for where, called in self.functions)


def systems_in(diagram):
    for system in diagram.GetSystems():
        yield system
        if isinstance(system, Diagram):
            yield from systems_in(system)


@pytest.fixture(scope="module")
def default_run():
    diagram = make_diagram(load_scenario("train", overrides=["cameras.render_processes=0"]))
    simulator = Simulator(diagram)
    simulator.Initialize()
    codes = set()

    def note(frame, event, _):
        if event == "call":
            codes.add(frame.f_code)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        simulator.AdvanceTo(DURATION)
    finally:
        sys.setprofile(before)
    own = [code for code in codes if code.co_filename.startswith(f"{PACKAGE}/")]
    functions = {(Path(code.co_filename).relative_to(PACKAGE).as_posix(), code.co_qualname) for code in own}
    return Executed(list(systems_in(diagram)), functions)


def test_the_tables_name_a_part_for_every_subsystem():
    assert list(rows()) == SUBSYSTEMS + SERVO_SIDE + JOINT_SIDE


@pytest.mark.parametrize(("file", "name"), POINTERS, ids=lambda pointer: pointer)
def test_the_default_run_executes_what_the_tables_name(file, name, default_run):
    assert default_run.has(file, name)


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("vision/several_vision_diagram.py", "SeveralVisionDiagram"),
        ("vision/silhouettes/tracker.py", "Tracker"),
        ("estimation/estimator_bank_system.py", "EstimatorBankSystem"),
        ("estimation/closed_path.py", "ClosedPathEstimator"),
        ("estimation/estimator.py", "make_estimator"),
    ],
    ids=lambda pointer: pointer,
)
def test_a_part_of_another_scenario_or_of_the_build_is_noticed(file, name, default_run):
    assert not default_run.has(file, name)
