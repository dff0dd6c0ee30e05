"""Loads what a track needs before live cameras are opened: they drop images while modules are loaded."""

from importlib import import_module

_MODULES = (
    "drake_tracker.estimation.coordinated_turn",
    "drake_tracker.own_cameras.overlay",
    "drake_tracker.vision.centroid.normal_flow",
    "drake_tracker.vision.centroid.normal_flow_parameters",
    "scipy.stats",
)
"""Modules that are slow to load, and loaded on first use elsewhere."""
_MODULES_OF_SEVERAL = ("scipy.optimize",)
"""The same for several objects."""


def load_ahead(objects: int) -> None:
    """Loads the modules.

    Args:
        objects: largest number of objects to track.
    """
    for name in _MODULES + (_MODULES_OF_SEVERAL if objects > 1 else ()):
        import_module(name)
