"""Tells the user of a run when the arm begins to reject packets, once for each reason."""

from collections.abc import Callable

from pydrake.systems.framework import Context, Diagram

from drake_tracker.arm.safety.packet_guard import REASONS, Rejection
from drake_tracker.core.messages import PacketReport


class PacketNews:
    """Watches the port ``packet_report`` of a diagram.

    Args:
        hand_eye: diagram to watch.
        tell: called with each line of news for the user.
    """

    def __init__(self, hand_eye: Diagram, tell: Callable[[str], object]) -> None:
        self._hand_eye, self._tell = hand_eye, tell
        self._told: set[Rejection] = set()

    def look(self, context: Context) -> None:
        """Tells the reasons that were not told before.

        Args:
            context: the diagram's Context.
        """
        report = PacketReport(self._hand_eye.GetOutputPort("packet_report").Eval(context))
        for reason, words in REASONS.items():
            if reason not in self._told and getattr(report, reason.name.lower()):
                self._told.add(reason)
                self._tell(f"arm: rejecting packets from {context.get_time():.2f} s on: {words}")
