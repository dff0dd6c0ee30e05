"""Immutable states, which Drake may share between Contexts."""

from collections.abc import Callable, Mapping
from typing import Any, Self

import numpy as np

from drake_tracker.core.messages import message_size


class FrozenState:
    """Base of the frozen dataclasses that are kept as abstract state in a Context.

    Drake clones a Context by deep copies of its abstract values. A subclass is immutable and therefore its own copy, so
    that cloning a Context is cheap however much the state remembers.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


def read_only(array: np.ndarray) -> np.ndarray:
    """Returns the array itself, made read-only, as every array in a `FrozenState` must be."""
    array.setflags(write=False)
    return array


def declare_outputs(system: Any, state: Any, outputs: Mapping[str, tuple[Any, Callable[[Any], Any]]]) -> None:
    """Declares output ports of a System that are functions of an abstract state alone.

    Args:
        system: a Drake LeafSystem under construction.
        state: index of its abstract state.
        outputs: {name: (named view of the message, or number of elements; function of the state that returns the
            elements)}, in the order of the ports.
    """
    for name, (view, values) in outputs.items():

        def calc(context: Any, output: Any, values: Callable[[Any], Any] = values) -> None:
            output.SetFromVector(values(context.get_abstract_state(int(state)).get_value()))

        size = view if isinstance(view, int) else message_size(view)
        system.DeclareVectorOutputPort(name, size, calc, {system.abstract_state_ticket(state)})
