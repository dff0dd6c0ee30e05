"""Finds the folder of the models."""

from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError

_PACKAGE = Path(__file__).parents[1]


def models_path() -> Path:
    """Returns the folder of the models, which contains a package.xml.

    It is ``models/`` next to the package in a checkout, and inside the package after installation from a wheel.

    Raises DrakeTrackerError when it is in neither place.
    """
    places = (_PACKAGE.parent / "models", _PACKAGE / "models")
    for place in places:
        if (place / "package.xml").is_file():
            return place
    raise DrakeTrackerError(f"the models are missing: there is no package.xml in {places[0]} or {places[1]}")
