"""The operator's panel: the commands of a person at the page, kept until the run reads them."""

import threading
from collections.abc import Collection
from typing import Any, NamedTuple

from drake_tracker.grasp.operator_override import OperatorMode

JOG_AXES = ("x", "y", "z", "yaw")
"""Axes along or about which the tool can be jogged: the axes of W, and the vertical axis of the tool."""
JOG_STEP, JOG_TURN = 0.01, 0.0873
"""Size of a step [m], and of a turn [rad]: 5 deg."""
MOST_STEPS = 20
"""Most steps that wait to be read; more than that come from a key that is held down while the run is paused."""


class Wish(NamedTuple):
    """Command of the operator.

    Attributes:
        mode: what the operator wants now.
        steps: whole steps along each of `JOG_AXES` since the last reading.
        selected: number of the track that the operator selected as the target, 0 for none.
    """

    mode: OperatorMode
    steps: tuple[int, int, int, int]
    selected: int = 0


class OperatorPanel:
    """Keeps the operator's wishes. Every method may be called from any thread."""

    def __init__(self) -> None:
        """Creates the panel of an operator who only supervises."""
        self._changed = threading.Lock()
        self._mode = OperatorMode.SUPERVISE
        self._steps = [0, 0, 0, 0]
        self._selected = 0

    @property
    def mode(self) -> OperatorMode:
        """The present command of the operator."""
        return self._mode

    def set_mode(self, name: Any) -> None:
        """Sets the mode, and drops steps that were not read.

        Args:
            name: "supervise", "stop" or "take_over". Raises ValueError for anything else.
        """
        names = {mode.name.lower(): mode for mode in OperatorMode}
        if not isinstance(name, str) or name not in names:
            raise ValueError(f"mode must be one of {', '.join(names)}")
        with self._changed:
            self._mode, self._steps = names[name], [0, 0, 0, 0]

    def jog(self, axis: Any, sign: Any) -> None:
        """Moves the tool by one step; without effect unless the operator has taken over.

        Args:
            axis: one of `JOG_AXES`.
            sign: 1 or -1. Raises ValueError for any other axis or sign.
        """
        if axis not in JOG_AXES or isinstance(sign, bool) or sign not in (1, -1):
            raise ValueError(f"axis must be one of {', '.join(JOG_AXES)}, and sign 1 or -1")
        with self._changed:
            if self._mode == OperatorMode.TAKE_OVER and sum(map(abs, self._steps)) < MOST_STEPS:
                self._steps[JOG_AXES.index(axis)] += int(sign)

    def select(self, number: Any, tracks: Collection[int]) -> None:
        """Selects a track as the target.

        Args:
            number: number of the track.
            tracks: numbers of the tracks that there are. Raises ValueError when the track is none of them.
        """
        if isinstance(number, bool) or not isinstance(number, int) or number not in tracks:
            raise ValueError("there is no such track")
        with self._changed:
            self._selected = number

    def read(self) -> Wish:
        """Returns the operator's wish; the steps count as read."""
        with self._changed:
            steps, self._steps = tuple(self._steps), [0, 0, 0, 0]
            return Wish(self._mode, steps, self._selected)  # type: ignore[arg-type]
