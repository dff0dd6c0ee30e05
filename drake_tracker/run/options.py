"""The options of a run."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RunOptions:
    """Options of a run: what it shows and records in addition to log and summary.

    Attributes:
        record: whether to make the 3-D recording and, with cameras, the video and the pictures of the motion detector
            and of the grasp.
        images: whether to keep the images that the vision reads, for a replay from images.
        meshcat: whether to show the scene in a browser during the run; the address is printed.
        mcap: whether to write the run as an MCAP file for Foxglove or Rerun; needs the extra ``mcap``.
        graphviz: file for a graph of the diagram in the DOT language of Graphviz, or None.
        stop_when_over: whether to end the run when the object was grasped or is lost, before the end of its duration.
        realtime_rate: greatest ratio of simulated time to wall time; 1 is real time, 0 is as fast as possible.
    """

    record: bool = True
    images: bool = False
    meshcat: bool = False
    mcap: bool = False
    graphviz: Path | None = None
    stop_when_over: bool = True
    realtime_rate: float = 0.0
