"""What the scenarios of all tasks share, as dataclasses with units, defaults and allowed ranges.

A role that has several kinds is a Union; a scenario file names the kind by its YAML tag, the first one is the default.
The classes stay within what Drake's own typed YAML can read and write (no frozen classes, tuples, Literal or Enum, no
postponed annotations), so that a resolved scenario is an ordinary Drake YAML file.
"""

import math
from dataclasses import dataclass
from typing import Optional, Union

from drake_tracker.core.setting import setting
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD


@dataclass
class Lighting:
    """The lamps of the room."""

    side: str = setting("cameras", "where the light comes from", choices=("cameras", "one_side"))
    shadows: bool = setting(False, "cast shadows")
    flicker: float = setting(0.0, "fraction by which the light flickers", "", (0.0, 1.0))
    flicker_hz: float = setting(100.0, "frequency of the flicker", "Hz", (0.0, 1000.0))


@dataclass
class NormalFlow:
    """The motion detector of section 3.1: normal flow, threshold, centroid. An empty value is the preset's own."""

    preset: str = setting("scaled", "set of values", choices=("scaled", "paper_literal", "paper_interlaced"))
    centroid: str = setting("hull", "mean of the moving pixels, or of their convex hull", choices=("mean", "hull"))
    path: str = setting("integer", "arithmetic", choices=("integer", "float"))
    stride: Optional[int] = setting(None, "cycles between the images used", "cycles", (1, 4))
    threshold_px: Optional[float] = setting(None, "normal flow that counts as motion", "px", (0.01, 100.0))
    threshold_window_s: Optional[float] = setting(None, "time in which it is measured", "s", (0.001, 1.0))
    difference_gate: Optional[float] = setting(None, "least temporal difference", "grey levels", (0.0, 255.0))
    noise_factor: Optional[float] = setting(None, "raises it to so many deviations of the noise", "", (0.0, 50.0))
    normalise_gain: Optional[bool] = setting(None, "take out changes of the whole image's brightness")
    denominator_floor: Optional[float] = setting(None, "least gradient used", "grey levels/px", (0.0, 255.0))
    norm: Optional[str] = setting(None, "norm of the gradient", choices=("l1", "l2"))
    smoothing_size: Optional[int] = setting(None, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: Optional[float] = setting(None, "standard deviation of the Gaussian", "px", (0.1, 10.0))
    min_pixels: Optional[int] = setting(None, "moving pixels that make a valid centroid", "px", (1, 65536))
    join_distance: Optional[int] = setting(None, "gap across which the hull joins edges", "px", (1, 512))
    brightness_gate: Optional[bool] = setting(None, "drop moving pixels never brighter than the background: shadows")


@dataclass
class Perfect:
    """A link that delivers every packet at once."""


@dataclass
class Lossy:
    """A link that loses and delays packets."""

    drop: float = setting(0.0, "long-run fraction of packets lost", "", (0.0, 1.0))
    delay: float = setting(0.0, "delay of every packet", "s", (0.0, 5.0))
    jitter: float = setting(0.0, "further delay, uniform from 0 to this", "s", (0.0, 5.0))
    burst: float = setting(1.0, "mean number of packets lost in a row", "packets", (1.0, 1000.0))


@dataclass
class Servo:
    """The trajectory generator's own filter."""

    tracking_index: float = setting(0.01, "manoeuvre noise over measurement noise, position", "", (0.001, 10.0))
    yaw_tracking_index: float = setting(0.003, "the same, direction", "", (0.0001, 10.0))
    stale_after: float = setting(0.2, "age of the newest packet at which it says it is stale", "s", (0.03, 10.0))


@dataclass
class Puma560:
    """The arm of the 1991 laboratory."""


@dataclass
class Custom:
    """A part of the user's own: what a class or a function of hers returns."""

    call: str = setting("", "class or function that makes the part, as module.name")
    parameters: dict[str, Union[float, bool, int, str]] = setting({}, "what it is called with")
    folder: str = setting("", "folder of the module; empty: the scenario's, the current one, or an installed package")


@dataclass
class BaseScenario:
    """What every scenario has."""

    task: str = setting("train", "what is to be done", choices=("train", "ball"))
    name: str = setting("", "the scenario's name; filled in when it is loaded")
    description: str = setting("", "one line for the list of scenarios")
    duration: float = setting(60.0, "simulated time after which the run ends", "s", (0.01, 36000.0))
    seed: int = setting(0, "of every random draw", "", (0, 2**32 - 1))
    time_step: float = setting(TIME_STEP, "step of the plant", "s", (0.0001, 0.01))

    def where(self, key):
        """Returns where a setting got its value, for an error message: "train.yaml line 12: track.speed", or
        "--set track.speed=2: track.speed", or "track.speed (default)".
        """
        origins = getattr(self, "origins", {})
        return f"{origins[key]}: {key}" if key in origins else f"{key} (default)"

    def timing_problems(self, servo_period):
        """Returns, as `problems` does, what the plant's step does not divide; ``servo_period`` in [s]."""
        found = []
        periods = ((VISION_PERIOD, "image period 1/60 s"), (servo_period, f"servo period {servo_period:g} s"))
        for period, what in periods:
            steps = period / self.time_step
            if not math.isclose(steps, round(steps), rel_tol=1e-6):
                default = type(self)().time_step
                example = f"1/{round(1.0 / default)} ({default!r})"
                found.append(("time_step", f"must divide the {what}; {example} does"))
        return found
