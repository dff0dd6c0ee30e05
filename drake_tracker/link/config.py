"""Settings of the links. The name of a class is its YAML tag."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class Perfect:
    """A link that delivers every packet at once."""


@dataclass(frozen=True)
class Lossy:
    """A link that loses and delays packets.

    Losses are independent, or come in bursts (the two-state Markov chain of Gilbert 1960).

    Attributes:
        drop: long-run fraction of packets lost, 0 to 1.
        delay: delay of every packet [s].
        jitter: largest additional delay [s]; each packet draws it uniformly from 0 to this.
        burst: mean number of packets lost in a row. Independent losses have bursts of 1 / (1 - drop) on average; a
            smaller number gives independent losses.
    """

    drop: float = setting(0.0, "long-run fraction of packets lost", "", (0.0, 1.0))
    delay: float = setting(0.0, "delay of every packet", "s", (0.0, 5.0))
    jitter: float = setting(0.0, "largest additional delay, drawn uniformly from 0 for each packet", "s", (0.0, 5.0))
    burst: float = setting(1.0, "mean number of packets lost in a row", "packets", (1.0, 1000.0))
