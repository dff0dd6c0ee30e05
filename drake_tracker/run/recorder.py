"""The interface of everything that records a run."""

from typing import Protocol

from pydrake.systems.framework import Context


class Recorder(Protocol):
    """Something that was added to a diagram to keep what happens in it.

    A recorder reads ports and writes as the run goes on, so that what it has is kept however the run ends.
    """

    def finish(self, root_context: Context) -> None:
        """Completes what was recorded. Called once, after the simulation, whether or not it was interrupted.

        Args:
            root_context: Context of the whole diagram at the end of the simulation.
        """
