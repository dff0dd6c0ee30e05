"""Settings of the simulated laboratories: the places of their parts, and of the cameras."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting

CLOSED_KINDS = ("oval", "stadium", "circle", "figure_eight")
"""Kinds of track that are always closed."""
OPEN_KINDS = ("line", "sinusoid", "polynomial", "random_walk")
"""Kinds of track that are always open: the train passes each place once."""
TRACK_KINDS = (*CLOSED_KINDS, *OPEN_KINDS, "csv")
LONGEST_WALK = 2.0
"""Greatest length of a random walk [m]."""
SPEED_LAWS = ("constant", "varying", "stop_and_go")
TRAIN_WIDTH = 0.040
"""Width of every train between the jaws [m] (models train); a cube has its own."""
TRAIN_SCALES = (0.5, 1.5)
"""Shortest and longest train, relative to its model."""
LIFTED = 0.10
"""Height [m] above its place on the rail at which the train counts as lifted."""
LIGHT_SIDES = ("cameras", "one_side")
TRAIN_BODIES = ("plain", "striped", "round", "dark", "cube")
TRAIN_SIZE, CUBE_EDGE = (0.12, TRAIN_WIDTH, 0.05), 0.030
"""Length, width and height of the body of a train of scale 1, and edge of a cube of scale 1 [m] (models train)."""
RENDER_PROCESSES = ("auto", "0", "1", "2")
_RENDER_PROCESSES_HELP = "processes that render beside the simulation; auto: one per spare processor, 2 at most"


def body_size(body: str, scale: float) -> tuple[float, float, float]:
    """Returns length, width and height [m] of a body that runs on the track. All edges of a cube grow with its scale.

    Args:
        body: which model, one of `TRAIN_BODIES`.
        scale: relative to the model.
    """
    length, width, height = TRAIN_SIZE
    return (scale * CUBE_EDGE,) * 3 if body == "cube" else (scale * length, width, height)


@dataclass(frozen=True)
class LightingConfig:
    """The lamps of the laboratory."""

    side: str = setting(
        "cameras", "position of the lamps: beside the cameras, or all to one side of them", choices=LIGHT_SIDES
    )
    shadows: bool = setting(False, "whether objects cast shadows")
    flicker: float = setting(0.0, "amplitude of the flicker as a fraction of the mean brightness", "", (0.0, 1.0))
    flicker_hz: float = setting(100.0, "frequency of the flicker", "Hz", (0.0, 1000.0))


@dataclass(frozen=True)
class NoEvent:
    """The speed changes as its law says, and not otherwise."""


@dataclass(frozen=True)
class SpeedEvent:
    """When the speed changes suddenly. One of ``at`` and ``after_launch`` must be given."""

    at: float | None = setting(None, "time of the change", "s", (0.0, 36000.0))
    after_launch: float | None = setting(
        None, "time between the beginning of the first descent and the change", "s", (0.0, 600.0)
    )
    duration: float | None = setting(
        None, "how long it lasts; null: to the end of the run", "s", (0.001, 36000.0), key="for"
    )


@dataclass(frozen=True)
class Stop(SpeedEvent):
    """The train stops."""


@dataclass(frozen=True)
class Reverse(SpeedEvent):
    """The train runs backwards at the same speed."""


@dataclass(frozen=True)
class ChangeSpeed(SpeedEvent):
    """The train runs faster or slower."""

    factor: float = setting(0.5, "speed relative to the speed of the law", "", (0.0, 5.0))


@dataclass(frozen=True)
class TrackConfig:
    """Where the train runs, and how fast. The controller knows none of this."""

    kind: str = setting("oval", "shape of the track", choices=TRACK_KINDS)
    semi_axes: tuple[float, ...] = setting(
        [0.16, 0.22], "half the extent of an oval or figure_eight along x and y", "m", (0.03, 1.0), shape=(2,)
    )
    radius: float = setting(0.12, "radius of a circle, and of the ends of a stadium", "m", (0.03, 1.0))
    straight: float = setting(0.20, "length of the two straights of a stadium", "m", (0.01, 2.0))
    length: float = setting(
        0.9,
        "length of a line; extent along y of a sinusoid or polynomial; total length of a random_walk, at most 2 m",
        "m",
        (0.2, 5.0),
    )
    amplitude: float = setting(0.05, "amplitude of a sinusoid, which runs along y, in x", "m", (0.001, 0.5))
    wavelength: float = setting(0.45, "length along y of one wave of a sinusoid", "m", (0.02, 10.0))
    coefficients: tuple[float, ...] = setting(
        [0.0, 0.15, 0.0, -0.15],
        "c0, c1, c2 ... of a polynomial x = c0 + c1 u + c2 u^2 ..., where u = y / (length / 2) goes from -1 to 1",
        "m",
        (-2.0, 2.0),
        shape=(None,),
    )
    corner_radius: float = setting(0.03, "radius of the corners of a random_walk", "m", (0.01, 1.0))
    straight_range: tuple[float, ...] = setting(
        [0.06, 0.25], "shortest and longest straight between two corners of a random_walk", "m", (0.02, 2.0), shape=(2,)
    )
    csv: str = setting(
        "",
        "file with the points of a track: header x,y (in the world) or x,y,z or x,y,z,bank; z above the table, m, deg",
    )
    closed: bool = setting(
        True,
        "only for kind csv: whether the last point is joined to the first. A file whose last point repeats the first "
        "is always closed. line, sinusoid, polynomial and random_walk are always open; the other kinds refuse false",
    )
    heights: tuple[float, ...] = setting(
        [],
        "heights above the table at places equally spaced along the track, joined smoothly; empty: a level track",
        "m",
        (0.01, 0.3),
        shape=(None,),
    )
    bank_deg: float = setting(
        0.0, "with heights: inward lean of the tightest bend; others lean less", "deg", (0.0, 20.0)
    )
    centre: tuple[float, ...] = setting([0.56, 0.0], "centre of the track in the world", "m", (-2.0, 2.0), shape=(2,))
    rotation_deg: float = setting(0.0, "rotation of the track about its centre", "deg", (-360.0, 360.0))
    centre_range: float = setting(0.03, "largest random displacement of the centre in x and in y", "m", (0.0, 0.5))
    rotation_range_deg: float = setting(15.0, "largest random rotation added to rotation_deg", "deg", (0.0, 180.0))
    speed: float = setting(0.15, "mean speed of the train", "m/s", (0.0, 1.0))
    speed_law: str = setting("constant", "how the speed varies with time", choices=SPEED_LAWS)
    variation: float = setting(0.15, "amplitude of a varying speed as a fraction of the mean speed", "", (0.0, 0.9))
    event: NoEvent | Stop | Reverse | ChangeSpeed = setting(NoEvent, "a sudden change of the speed")
    turns: bool = setting(
        True, "whether the train turns with the track; false: it lies along x of the world, as the controller knows"
    )
    direction: str = setting(
        "random", "direction of travel; random: drawn from the seed", choices=("random", "forward", "backward")
    )
    start: float = setting(-1.0, "starting point as a fraction of the track; -1: drawn from the seed", "", (-1.0, 1.0))


@dataclass(frozen=True)
class TrainConfig:
    """The train: its appearance, its length, and when it starts."""

    body: str = setting("plain", "which of the train models runs; cube: an edge of 30 mm", choices=TRAIN_BODIES)
    colour: str = setting("", "main colour of the train, as #rrggbb; empty: the colour of the model")
    scale: float = setting(
        1.0,
        "length and mass relative to the model; width and height stay, for track and jaws, except of a cube",
        "",
        TRAIN_SCALES,
    )
    start_delay: float = setting(0.0, "time until which the train stands", "s", (0.0, 3600.0))


@dataclass(frozen=True)
class NoWristCamera:
    """The hand carries no camera."""


@dataclass(frozen=True)
class WristCamera:
    """A camera on the hand, which sees the object from above until the jaws hold it.

    It looks along the approach of the hand, tilted towards the axis of the tool. Its pixels are square.
    """

    width: int = setting(128, "image width", "px", (16, 1024))
    height: int = setting(128, "image height", "px", (16, 1024))
    fov_deg: float = setting(60.0, "vertical field of view", "deg", (10.0, 120.0))
    offset: tuple[float, ...] = setting(
        [0.06, 0.0, -0.10],
        "position in the frame of the tool, whose z axis is the approach",
        "m",
        (-0.3, 0.3),
        shape=(3,),
    )
    tilt_deg: float = setting(15.0, "angle between its axis and the approach", "deg", (-60.0, 60.0))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    calibration: str = setting("train_wrist.yaml", "file with its calibrated lens and its pose on the hand")


@dataclass(frozen=True)
class CamerasConfig:
    """The two fixed cameras, left and right, and the camera on the hand."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(30.0, "vertical field of view", "deg", (2.0, 120.0))
    distance: float = setting(1.4, "distance of both cameras from look_at", "m", (0.3, 5.0))
    azimuth_deg: tuple[float, ...] = setting(
        [45.0, -45.0], "azimuths of the left and the right camera", "deg", (-180.0, 180.0), shape=(2,)
    )
    elevation_deg: float = setting(20.0, "elevation of both cameras above look_at", "deg", (1.0, 89.0))
    look_at: tuple[float, ...] = setting(
        [0.56, 0.0, 0.47], "point at which both cameras look", "m", (-2.0, 3.0), shape=(3,)
    )
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    render_window: bool = setting(True, "render only the window of interest instead of the full image")
    calibration: str = setting("train_cameras.yaml", "file with the calibrated camera models")
    render_processes: str = setting("auto", _RENDER_PROCESSES_HELP, choices=RENDER_PROCESSES)
    wrist: NoWristCamera | WristCamera = setting(NoWristCamera, "whether the hand carries a camera too")


@dataclass(frozen=True)
class BoardConfig:
    """The inclined board and its pegs. The rest is drawn from the seed."""

    incline_deg: float = setting(10.0, "angle between the board and the horizontal", "deg", (2.0, 30.0))
    length: float = setting(0.90, "length along the slope", "m", (0.88, 1.5))
    width: float = setting(0.60, "width across the slope", "m", (0.56, 1.0))
    edge_position: tuple[float, ...] = setting(
        [0.55, 0.0, 0.50], "middle of the bottom edge in the world", "m", (-2.0, 2.0), shape=(3,)
    )
    placement_range: ClassVar[float] = 0.01
    """Largest random displacement of the board in x and in y [m]; chosen."""
    rotation_range_deg: float = setting(
        2.0, "largest random rotation of the board about the vertical", "deg", (0.0, 20.0)
    )
    walls: bool = setting(True, "whether there are walls along the two long sides")
    peg_count: int = setting(-1, "number of pegs; -1: 12 to 14, drawn from the seed", "", (-1, 40))
    knock_time: float = setting(0.0, "time at which the board is knocked sideways; 0: never", "s", (0.0, 3600.0))
    distractor: bool = setting(False, "whether a box slides to and fro beside the board")


@dataclass(frozen=True)
class BallConfig:
    """Where the ball starts, and whether it is released."""

    start_x: float | None = setting(
        None, "starting point across the board; null: drawn from the seed", "m", (-0.22, 0.22)
    )
    release: bool = setting(True, "whether the gate opens")


@dataclass(frozen=True)
class BoardCameraConfig:
    """The one camera, placed at random so that the whole board is in view."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(45.0, "vertical field of view", "deg", (2.0, 120.0))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    supersampling: int = setting(
        2, "side of the square of rendered pixels that is averaged into one image pixel", "", (1, 8)
    )
    distance_range: tuple[float, ...] = setting(
        [1.5, 1.9], "smallest and largest distance from the middle of the board", "m", (0.5, 10.0), shape=(2,)
    )
    azimuth_range_deg: float = setting(
        50.0, "largest azimuth to either side of the upward direction of the slope", "deg", (0.0, 180.0)
    )
    elevation_range_deg: tuple[float, ...] = setting(
        [40.0, 65.0], "smallest and largest elevation above the horizontal", "deg", (5.0, 85.0), shape=(2,)
    )
    roll_range_deg: float = setting(5.0, "largest roll to either side about the optical axis", "deg", (0.0, 180.0))
    render_window: bool = setting(True, "render only the board and its surroundings instead of the full image")
    render_processes: str = setting("auto", _RENDER_PROCESSES_HELP, choices=RENDER_PROCESSES)


@dataclass(frozen=True)
class OperatorConfig:
    """The operator's work before a run: marking the circles in the image, and jogging the arm over the touch marks."""

    windows: tuple[tuple[float, ...], ...] = setting(
        [],
        "windows (u0, v0, width, height), one around each circle; empty: the circles are detected automatically",
        "px",
        (0.0, 4096.0),
        shape=(None, 4),
    )
    threshold: float = setting(
        110.0, "brightest grey level at which a pixel in a window counts as dark", "grey levels", (1.0, 254.0)
    )
    placing_std: ClassVar[float] = 0.0005
    """Standard deviation of the tip's placement error over a mark, per axis [m]; chosen."""
