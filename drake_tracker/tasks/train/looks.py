"""Sizes and colours of the objects of a scenario of the train, which measured vision gives its tracks."""

from typing import Any

from drake_tracker.core.colour import rgb
from drake_tracker.measured.measured_tracks import ObjectLook
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.world.config import TRAIN_WIDTH
from drake_tracker.world.train.driven_objects import HAND_LENGTH, HAND_THICKNESS, HAND_WIDTH
from drake_tracker.world.train.objects_config import Ball, Hand
from drake_tracker.world.train.rail import TRAIN_LENGTH
from drake_tracker.world.train.train_model import BODY_HEIGHT, train_colour


def object_looks(scenario: TrainScenario) -> tuple[ObjectLook, ...]:
    """Returns size and colour of the first train and of the further objects of a scenario, in its order."""
    return tuple(_look(each) for each in (scenario.train, *scenario.objects))


def _look(settings: Any) -> ObjectLook:
    """Returns size and colour of an object with the given settings."""
    if isinstance(settings, Ball):
        size = (2.0 * settings.radius,) * 3
    elif isinstance(settings, Hand):
        size = (HAND_LENGTH, HAND_WIDTH, HAND_THICKNESS)
    else:
        size = (settings.scale * TRAIN_LENGTH, TRAIN_WIDTH, BODY_HEIGHT)
    colour = rgb(settings.colour) if settings.colour else train_colour(settings.body)
    red, green, blue = (255.0 * float(value) for value in colour)
    return ObjectLook(size, (red, green, blue))
