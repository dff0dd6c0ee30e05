"""Search along connections and Python references, for tests that ground truth does not reach the controller."""

import functools
import types

import numpy as np
from pydrake.systems.framework import Diagram


def controller_subsystems(hand_eye):
    return {"vision": hand_eye.vision, "host": hand_eye.host, "link": hand_eye.link, "arm": hand_eye.arm}


def arrows(hand_eye):
    """Returns all connections between subsystems: (source, its output port, reader, its input port)."""
    found = set()
    for (reader, k), (source, j) in hand_eye.connection_map().items():
        ports = source.get_output_port(int(j)).get_name(), reader.get_input_port(int(k)).get_name()
        found.add((source.get_name(), ports[0], reader.get_name(), ports[1]))
    return found


class Wires:
    """The connections of a diagram and of all diagrams in it, to be followed upstream."""

    def __init__(self, root):
        self.parent = {}
        self._connections = {}
        self._exported = {}
        self._enter(root)

    def _enter(self, diagram):
        for (reader, port), (source, source_port) in diagram.connection_map().items():
            self._connections[reader, int(port)] = (source, int(source_port))
        for index in range(diagram.num_input_ports()):
            for reader, port in diagram.GetInputPortLocators(diagram.get_input_port(index).get_index()):
                self._exported[reader, int(port)] = (diagram, index)
        for system in diagram.GetSystems():
            self.parent[system] = diagram
            if isinstance(system, Diagram):
                self._enter(system)

    def leave_open(self, system, port):
        """Treats an input as unconnected, although it is exported."""
        del self._exported[system, int(system.GetInputPort(port).get_index())]

    def source(self, system, index):
        """Returns the leaf System and output port that drive an input, or None."""
        while (system, index) in self._exported:
            system, index = self._exported[system, index]
        assert system in self.parent, f"{system.get_name()} is driven from outside the diagram"
        if (system, index) not in self._connections:
            return None
        source, port = self._connections[system, index]
        while isinstance(source, Diagram):
            source, port = source.get_output_port_locator(source.get_output_port(port).get_index())
        return source, int(port)

    def upstream(self, starts, allowed):
        """Returns all output ports upstream of the inputs of ``starts``, {(leaf, port): path}.

        Every output of a leaf is assumed to depend on all its inputs, also without feedthrough, since state can carry
        ground truth. The search stops at the ports ``allowed``.
        """
        paths = {}
        todo = [(system, index, system.get_name()) for system in starts for index in range(system.num_input_ports())]
        while todo:
            system, index, path = todo.pop()
            found = self.source(system, index)
            if found is None or found in paths:
                continue
            paths[found] = f"{path} <- {found[0].get_name()}.{found[0].get_output_port(found[1]).get_name()}"
            if found not in allowed:
                leaf = found[0]
                todo += [(leaf, k, paths[found]) for k in range(leaf.num_input_ports())]
        return paths

    def inside(self, system, diagram):
        while system in self.parent:
            system = self.parent[system]
            if system is diagram:
                return True
        return False


PLAIN = (type(None), bool, int, float, complex, str, bytes, np.ndarray, np.generic, type, types.ModuleType)
PYDRAKE_REFERENCES = "_pydrake_internal_ref_cycle_peers"
"""Attribute in which pydrake keeps the parts of a diagram alive."""


def parts(thing):
    """Yields (name, part) of everything that a Python object refers to directly."""
    if isinstance(thing, dict):
        yield from ((f"[{key!r}]", value) for key, value in thing.items())
        yield from (("key", key) for key in thing)
    elif isinstance(thing, (list, tuple, set, frozenset)):
        yield from ((f"[{k}]", value) for k, value in enumerate(thing))
    elif isinstance(thing, functools.partial):
        yield from (("func", thing.func), ("args", thing.args), ("keywords", thing.keywords))
    elif isinstance(thing, types.MethodType):
        yield from (("self", thing.__self__), ("function", thing.__func__))
    elif isinstance(thing, types.FunctionType):
        yield "defaults", (thing.__defaults__, thing.__kwdefaults__)
        for name, cell in zip(thing.__code__.co_freevars, thing.__closure__ or ()):
            yield name, cell.cell_contents
    for name, part in getattr(thing, "__dict__", {}).items():
        if name != PYDRAKE_REFERENCES:
            yield name, part
    for kind in type(thing).__mro__:
        slots = getattr(kind, "__slots__", ())
        for slot in [slots] if isinstance(slots, str) else slots:
            if hasattr(thing, slot):
                yield slot, getattr(thing, slot)


def references(start):
    """Yields (path, object) of everything that an object refers to through attributes, containers and closures."""
    seen, todo = {}, [("", start)]
    while todo:
        path, thing = todo.pop()
        if isinstance(thing, PLAIN) or id(thing) in seen:
            continue
        seen[id(thing)] = thing  # kept, so that its id is not reused
        yield path, thing
        todo += [(f"{path}.{name}", part) for name, part in parts(thing)]


def leaves(system):
    if not isinstance(system, Diagram):
        return [system]
    return [system] + [leaf for part in system.GetSystems() for leaf in leaves(part)]


def truths(subsystem, is_truth):
    """Returns the ground truth to which the objects of a subsystem refer, {name of the System: [(path, type)]}."""
    found = {}
    for system in leaves(subsystem):
        paths = [(path, type(thing).__name__) for path, thing in references(system) if is_truth(thing)]
        if paths:
            found[system.get_name()] = paths
    return found
