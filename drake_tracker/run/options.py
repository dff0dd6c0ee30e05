"""The options of a run."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RunOptions:
    """What a run shows and records besides log and summary.

    Attributes:
        record: make the 3-D recording and, with cameras, the video and the picture of the motion detector.
        images: keep the images that the vision reads, for a replay from images.
        meshcat: show the scene in a browser while the run goes on; the address is printed.
        graphviz: file for a picture of the diagram in the language of Graphviz, or None.
        stop_when_over: end the run when the object was grasped or is lost; else it takes the whole duration.
        realtime_rate: simulated time advances at most this much faster than wall time, 1 being real time; 0 is as
            fast as possible.
    """

    record: bool = True
    images: bool = False
    meshcat: bool = False
    graphviz: Path | None = None
    stop_when_over: bool = True
    realtime_rate: float = 0.0
