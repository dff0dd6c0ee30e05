"""Settings of the vision of parts on a belt."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting
from drake_tracker.vision.config import Contrast


@dataclass(frozen=True)
class BeltParts(Contrast):
    """Finds the parts on a moving belt: foreground regions with the outline of a part."""

    largest_misfit: ClassVar[float] = 0.03
    """Largest mean square of the difference between silhouette and outline of a new part; a known part may have twice
    as much; chosen."""
    confirm_after: int = setting(8, "pairs of images after which a new part is reported", "", (1, 1000))
    coast_time: float = setting(3.0, "time after which a part that the arm hides is forgotten", "s", (0.05, 60.0))
    lost_after: ClassVar[float] = 0.3
    """Time after which a part that is not where it should be is forgotten [s]; chosen."""
