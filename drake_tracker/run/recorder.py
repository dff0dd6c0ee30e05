"""The interface of everything that records a run."""

from typing import Protocol

from pydrake.systems.framework import Context


class Recorder(Protocol):
    """A part of a diagram that records a run.

    A recorder reads output ports and writes during the run, so that its files are kept however the run ends.
    """

    def finish(self, root_context: Context) -> None:
        """Completes the recording. It is called once, after the simulation, also when that was interrupted.

        Args:
            root_context: Context of the whole diagram at the end of the simulation.
        """
        ...
