"""Settings of the links. The name of a class is its YAML tag."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class Perfect:
    """A link that delivers every packet at once."""


@dataclass(frozen=True)
class Lossy:
    """A link that loses and delays packets."""

    drop: float = setting(0.0, "long-run fraction of packets lost", "", (0.0, 1.0))
    delay: float = setting(0.0, "delay of every packet", "s", (0.0, 5.0))
    jitter: float = setting(0.0, "further delay, uniform from 0 to this", "s", (0.0, 5.0))
    burst: float = setting(1.0, "mean number of packets lost in a row", "packets", (1.0, 1000.0))
