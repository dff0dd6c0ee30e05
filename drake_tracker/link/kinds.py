"""The registry of the links."""

from typing import TYPE_CHECKING, Any

from drake_tracker.core.registry import Registry
from drake_tracker.link.config import Lossy, Perfect

if TYPE_CHECKING:
    from drake_tracker.link.link import Link

LINKS: "Registry[Link[Any]]" = Registry(
    "link",
    {
        Perfect: "drake_tracker.link.lossy_link:perfect_link",
        Lossy: "drake_tracker.link.lossy_link:LossyLink",
    },
)
"""Every link of the package by its settings; the one place where a link is registered. `Registry.make` returns its
arithmetic (`Link`), `drake_tracker.link.link_system.make_link` its System."""
