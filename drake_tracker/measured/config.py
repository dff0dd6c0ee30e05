"""Settings of the vision that reads the truth. The name of a class is its YAML tag."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting
from drake_tracker.vision.silhouettes.target_config import TARGETS, First


@dataclass(frozen=True)
class OneObject:
    """Measured vision sees the first train only."""


@dataclass(frozen=True)
class SeveralObjects:
    """Measured vision sees all objects."""

    target: TARGETS.union() = setting(  # type: ignore[valid-type]
        First, "which of the objects to follow", shared=True
    )
    confirm_after: int = setting(5, "cycles after which a new track is confirmed", "", (1, 1000), shared=True)
    coast_time: float = setting(
        2.0, "time after which a track that is not seen is deleted", "s", (0.05, 60.0), shared=True
    )


@dataclass(frozen=True)
class MeasuredParts:
    """Vision of the parts on a belt without images: their true poses plus random errors.

    The defaults are the errors of the vision with cameras on seeds 5 and 21 to 24
    (`benchmarks/methods/part_vision_errors.py`).
    """

    noise_std: ClassVar[float] = 0.0003
    """Standard deviation of the position that changes in every cycle [m]; measured, see above."""
    bias_std: ClassVar[float] = 0.00025
    """Standard deviation of the position that each part keeps [m]; measured, see above."""
    turn_noise_std_deg: ClassVar[float] = 1.0
    """Standard deviation of the direction that changes in every cycle [deg]; measured, see above."""
    turn_bias_std_deg: ClassVar[float] = 0.8
    """Standard deviation of the direction that each part keeps [deg]; measured, see above."""
    lag_cycles: int = setting(
        15, "time from the capture of an image to the parts in it", "cycles", (0, 120), shared=True
    )
