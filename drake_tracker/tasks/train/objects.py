"""Makes the further objects of a scenario of the train."""

from dataclasses import replace
from typing import Any

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.track_placement import misplaced, place_other_track
from drake_tracker.world.config import NoEvent, TrackConfig, body_size
from drake_tracker.world.scene_object import Ride, SceneObject
from drake_tracker.world.train.objects_config import OBJECTS, Ball, Train
from drake_tracker.world.train.plant import TABLE_TOP
from drake_tracker.world.train.tracks import Track

BUFFERS = 0.015
"""Length by which the buffers of two trains are beyond their ends, together [m]."""


def train_objects(scenario: TrainScenario, track: Track, start: float) -> tuple[SceneObject, ...]:
    """Returns the further objects of a scenario, in its order.

    Args:
        scenario: the scenario.
        track: track of the first train, in the direction of travel.
        start: arc length at which the first train starts [m].

    Raises DrakeTrackerError when an object has no place on its track or on the table.
    """
    made = []
    standing = [(start, body_size(scenario.train.body, scenario.train.scale)[0])]
    for number, settings in enumerate(scenario.objects):
        context: dict[str, Any] = {"number": number, "table_height": scenario.table_height}
        if isinstance(settings, Train):
            config, own, place = scenario.track, track, start + settings.ahead
            if settings.track is None:
                _check_place(scenario, number, settings, track, place, standing)
                standing.append((place, body_size(settings.body, settings.scale)[0]))
            else:
                config = settings.track
                own, place = _own_track(scenario, number, settings, config)
            context["motion"] = Ride(
                own,
                place,
                speed=config.speed if settings.speed is None else settings.speed,
                speed_law=config.speed_law,
                variation=config.variation,
                start_delay=settings.start_delay,
                scale=settings.scale,
                body=settings.body,
                turns=config.turns,
            )
        elif isinstance(settings, Ball):
            _check_ball(scenario, number, settings)
        made.append(OBJECTS.make(settings, **context))
    return tuple(made)


def _own_track(scenario: TrainScenario, number: int, settings: Train, config: TrackConfig) -> tuple[Track, float]:
    """Returns the track of a train that has its own, and the arc length at which the train starts [m].

    Raises DrakeTrackerError when the track does not fit into the work volume or on the table, or has an event.
    """
    if not isinstance(config.event, NoEvent):
        raise DrakeTrackerError(
            f"{scenario.where(f'objects[{number}].track.event')} = !{type(config.event).__name__}: "
            "only the first train can have an event"
        )
    train = replace(scenario.train, body=settings.body, scale=settings.scale)
    other = replace(scenario, track=config, train=train)
    track, start = place_other_track(other, number)
    problem = misplaced(other, track, start)
    if problem is not None:
        raise DrakeTrackerError(f"{scenario.where(f'objects[{number}].track.kind')} = {config.kind}: {problem}")
    return track, start


def _check_place(
    scenario: TrainScenario,
    number: int,
    settings: Train,
    track: Track,
    place: float,
    standing: list[tuple[float, float]],
) -> None:
    """Raises DrakeTrackerError when a train would start beyond the end of the first train's track, or in another train.

    Args:
        scenario: the scenario.
        number: place of the train in the list of objects.
        settings: of the train.
        track: track of the first train.
        place: arc length at which the train would start [m].
        standing: (arc length, length) [m] of the trains that are already on the track.
    """
    where = scenario.where(f"objects[{number}].ahead")
    length, _, _ = body_size(settings.body, settings.scale)
    margin = 0.5 * length
    if not track.closed and not margin <= place <= track.length - margin:
        raise DrakeTrackerError(
            f"{where} = {settings.ahead:g}: the train would start {place:.3f} m from the beginning of the track; "
            f"from {margin:.3f} to {track.length - margin:.3f} m are allowed"
        )
    for other, other_length in standing:
        gap = place - other
        if track.closed:
            gap = (gap + 0.5 * track.length) % track.length - 0.5 * track.length
        needed = 0.5 * (length + other_length) + BUFFERS
        if abs(gap) < needed:
            raise DrakeTrackerError(
                f"{where} = {settings.ahead:g}: the train would start {abs(gap):.3f} m from another train; "
                f"at least {needed:.3f} m are needed"
            )


def _check_ball(scenario: TrainScenario, number: int, settings: Ball) -> None:
    """Raises DrakeTrackerError when a ball would roll beyond the edge of the table."""
    heading = np.deg2rad(settings.heading_deg)
    way = settings.amplitude * np.array([np.cos(heading), np.sin(heading)])
    for end in (settings.place - way, settings.place + way):
        if (end < TABLE_TOP[0]).any() or (end > TABLE_TOP[1]).any():
            (x_low, y_low), (x_high, y_high) = TABLE_TOP
            raise DrakeTrackerError(
                f"{scenario.where(f'objects[{number}].place')}: the ball would roll to ({end[0]:.3f}, {end[1]:.3f}) m, "
                f"beyond the table, which covers x {x_low:g} to {x_high:g}, y {y_low:g} to {y_high:g} m"
            )
