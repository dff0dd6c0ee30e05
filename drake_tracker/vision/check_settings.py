"""Range checks of settings that were not read from a scenario file, where the reader checks them."""

import math
import numbers
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.setting import allowed, kinds_of, settings_of

_NOUNS = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}


def check_settings(settings: Any, owner: str) -> None:
    """Raises DrakeTrackerError when a value of a settings dataclass is not allowed by its `setting`.

    Nested settings are checked where their own part is constructed, and tuples by the part that reads them.

    Args:
        settings: instance of a dataclass made of `setting` fields.
        owner: what the settings belong to, for messages: "normal flow".
    """
    for field in settings_of(settings):
        value, kinds = getattr(settings, field.name), kinds_of(field.type)
        if (value is None and type(None) in kinds) or kinds[0] not in _NOUNS:
            continue
        if not _fits(value, kinds[0], field.metadata):
            raise DrakeTrackerError(
                f"{owner}: {field.name} is {value!r}; it must be {allowed(field.metadata, _NOUNS[kinds[0]])}"
            )


def check_odd(size: int, owner: str) -> None:
    """Raises DrakeTrackerError when the side of a smoothing mask [px] is even: the mask would have no centre."""
    if size % 2 == 0:
        raise DrakeTrackerError(f"{owner}: smoothing_size is {size} px; it must be odd")


def _fits(value: Any, kind: Any, metadata: Any) -> bool:
    if kind in (int, float):
        if not isinstance(value, numbers.Real) or isinstance(value, bool):
            return False
        number = float(value)
        low, high = metadata.get("range") or (-math.inf, math.inf)
        return math.isfinite(number) and low <= number <= high and (kind is float or number.is_integer())
    return isinstance(value, kind) and (not metadata.get("choices") or value in metadata["choices"])
