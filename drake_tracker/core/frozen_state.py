"""Immutable states, which Drake may share between Contexts."""

from typing import Any, Self

import numpy as np


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
