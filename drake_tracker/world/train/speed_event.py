"""Sudden changes of the train's speed: it stops, reverses, or changes its speed."""

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import ChangeSpeed, NoEvent, Reverse, Stop

SpeedEvent = Stop | Reverse | ChangeSpeed


def check_event(event: SpeedEvent | NoEvent) -> None:
    """Raises DrakeTrackerError unless an event has exactly one of ``at`` and ``after_launch``."""
    if not isinstance(event, NoEvent) and (event.at is None) == (event.after_launch is None):
        name = type(event).__name__
        raise DrakeTrackerError(f"track.event: !{name} needs either 'at' or 'after_launch', and not both")


def waits_for_launch(event: SpeedEvent | NoEvent) -> bool:
    """Returns whether an event is relative to the beginning of the first descent."""
    return not isinstance(event, NoEvent) and event.after_launch is not None


def speed_factor(event: SpeedEvent | NoEvent, time: float, launched: float) -> float:
    """Returns the factor by which an event changes the target speed.

    Args:
        event: the event.
        time: [s].
        launched: beginning of the first descent [s], infinity before it.
    """
    if isinstance(event, NoEvent):
        return 1.0
    start = launched + event.after_launch if event.after_launch is not None else event.at
    if start is None or not start <= time < start + (float("inf") if event.duration is None else event.duration):
        return 1.0
    if isinstance(event, ChangeSpeed):
        return event.factor
    return -1.0 if isinstance(event, Reverse) else 0.0
