"""States that Drake may share between Contexts because nothing in them can change."""

from typing import Any, Self

import numpy as np


class FrozenState:
    """Base of the frozen dataclasses that are kept as abstract state in a Context.

    Drake copies a Context by deep copies of its abstract values. A subclass is immutable, so that it is its own copy,
    which makes cloning a Context cheap however much the state remembers.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


def read_only(array: np.ndarray) -> np.ndarray:
    """Returns the array itself with its write flag cleared, as every array in a `FrozenState` must be."""
    array.setflags(write=False)
    return array
