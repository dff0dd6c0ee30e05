"""The scene of a task from above, on the live page: what a task tells about it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Overview:
    """What the live page draws from above, and where it comes from.

    Attributes:
        ports: {output port of the diagram: its named view, or None for a vector of any size}.
        facts: function of (scenario, diagram) that returns what does not change, a dict for JSON.
        values: function of (simulated time [s], position of the tool in W [m], {port: message}) that returns what
            changes, a dict for JSON.
    """

    ports: Mapping[str, Any]
    facts: Callable[[Any, Any], dict[str, Any]]
    values: Callable[[float, np.ndarray, Mapping[str, Any]], dict[str, Any]]
