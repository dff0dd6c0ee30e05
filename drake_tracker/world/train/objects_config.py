"""Settings of the further moving objects of the train's laboratory. The name of a class is its YAML tag."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from drake_tracker.core.registry import Registry
from drake_tracker.core.setting import setting
from drake_tracker.world.config import TRAIN_BODIES, TRAIN_SCALES, TrackConfig

if TYPE_CHECKING:
    from drake_tracker.world.scene_object import SceneObject


@dataclass(frozen=True)
class Train:
    """Another train that runs by itself, on the track of the first one or on its own.

    A separate track is placed at random like the track of the first train, but the arm need not reach it.
    """

    body: str = setting("striped", "as train.body", choices=TRAIN_BODIES)
    colour: str = setting("", "main colour of the train, as #rrggbb; empty: the colour of the model")
    scale: float = setting(1.0, "as train.scale", "", TRAIN_SCALES)
    start_delay: float = setting(0.0, "time until which the train stands", "s", (0.0, 3600.0))
    ahead: float = setting(
        -0.6,
        "distance along the track ahead of the first train; negative: behind; not used with its own track",
        "m",
        (-10.0, 10.0),
    )
    speed: float | None = setting(None, "mean speed; null: the speed of its track", "m/s", (0.0, 1.0))
    track: TrackConfig | None = setting(
        None, "a separate track, with the settings of track; null: the track of the first train"
    )


@dataclass(frozen=True)
class Ball:
    """A ball that rolls to and fro over the table. By default it stays inside the oval track, clear of the train."""

    radius: float = setting(0.02, "radius of the ball", "m", (0.005, 0.1))
    colour: str = setting("#c03028", "colour of the ball, as #rrggbb")
    place: tuple[float, ...] = setting(
        [0.56, 0.0], "middle of its path over the table, in the world", "m", (-2.0, 2.0), shape=(2,)
    )
    heading_deg: float = setting(90.0, "direction in which it sets off, from x towards y", "deg", (-360.0, 360.0))
    speed: float = setting(0.1, "its largest speed", "m/s", (0.01, 1.0))
    amplitude: float = setting(0.07, "distance of both ends of its path from the middle", "m", (0.005, 0.5))
    at: float = setting(0.0, "time until which it lies at one end of its path", "s", (0.0, 36000.0))


@dataclass(frozen=True)
class Hand:
    """A hand reaches in over the edge of the table, moves to and fro and leaves again. Nothing can touch it."""

    colour: str = setting("#d9a07e", "colour of the skin, as #rrggbb")
    place: tuple[float, ...] = setting(
        [0.70, 0.0], "place of its fingertips in the middle of its motion, in the world", "m", (-2.0, 2.0), shape=(2,)
    )
    height: float = setting(0.08, "distance of its underside from the table", "m", (0.01, 0.5))
    heading_deg: float = setting(
        180.0, "direction in which it reaches in, from x towards y; 180: towards the arm", "deg", (-360.0, 360.0)
    )
    speed: float = setting(0.2, "its largest speed while it moves to and fro", "m/s", (0.01, 1.0))
    amplitude: float = setting(0.05, "distance by which it moves to and fro, along its heading", "m", (0.0, 0.3))
    at: float = setting(3.0, "time at which it begins to reach in", "s", (0.0, 36000.0))
    duration: float | None = setting(
        5.0, "time until it has left; null: it stays to the end of the run", "s", (0.5, 36000.0), key="for"
    )


OBJECTS: "Registry[SceneObject]" = Registry(
    "object",
    {
        Train: "drake_tracker.world.train.driven_objects:OtherTrain",
        Ball: "drake_tracker.world.train.driven_objects:RollingBall",
        Hand: "drake_tracker.world.train.driven_objects:WavingHand",
    },
)
"""Every kind of object by its settings; the one place where a kind of object is registered."""
