"""Settings of the choice of the target: which of several tracked objects is followed.

The name of a class is its YAML tag. Values are checked when the rule of the settings is made, as those of
`config.py`.
"""

from dataclasses import dataclass
from typing import Any

from drake_tracker.core.registry import Registry
from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class First:
    """Follows the object that was seen first."""


@dataclass(frozen=True)
class Largest:
    """Follows the largest object."""


@dataclass(frozen=True)
class Nearest:
    """Follows the object that is nearest to a point."""

    point: tuple[float, ...] = setting([0.56, 0.0, 0.48], "the point in W", "m", (-10.0, 10.0), shape=(3,))
    within: float = setting(10.0, "largest distance of the object", "m", (0.0, 100.0))


@dataclass(frozen=True)
class Inside:
    """Follows the first object that is inside a box."""

    box: tuple[tuple[float, ...], ...] = setting(
        [[0.33, -0.30, 0.40], [0.79, 0.30, 0.60]], "lowest and highest corner in W", "m", (-10.0, 10.0), shape=(2, 3)
    )


@dataclass(frozen=True)
class Coloured:
    """Follows the object whose colour is most similar to a given one."""

    colour: str = setting("#d0b040", "the colour as #rrggbb")
    tolerance: float = setting(25.0, "largest difference of the hue", "deg", (1.0, 180.0))


@dataclass(frozen=True)
class Selected:
    """Follows the object that the operator selects in the live page, and nothing until then."""


TARGETS: "Registry[Any]" = Registry(
    "target",
    {
        First: "drake_tracker.vision.silhouettes.target_rules:FirstRule",
        Largest: "drake_tracker.vision.silhouettes.target_rules:LargestRule",
        Nearest: "drake_tracker.vision.silhouettes.target_rules:NearestRule",
        Inside: "drake_tracker.vision.silhouettes.target_rules:InsideRule",
        Coloured: "drake_tracker.vision.silhouettes.target_rules:ColouredRule",
        Selected: "drake_tracker.vision.silhouettes.target_rules:SelectedRule",
    },
)
"""Every rule of the package by its settings; the one place where a rule is registered."""
