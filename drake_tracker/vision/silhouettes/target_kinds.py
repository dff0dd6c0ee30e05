"""The registry of the rules that choose the target."""

from typing import TYPE_CHECKING

from drake_tracker.core.registry import Registry
from drake_tracker.vision.silhouettes.target_config import (
    Coloured,
    First,
    Inside,
    Largest,
    Nearest,
    Selected,
)

if TYPE_CHECKING:
    from drake_tracker.vision.silhouettes.target import TargetRule

TARGETS: "Registry[TargetRule]" = Registry(
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
