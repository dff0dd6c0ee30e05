"""Settings of the simulated laboratories: what stands where, and how the cameras look at it."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting

TRACK_KINDS = ("oval", "stadium", "circle", "figure_eight", "line", "csv")


@dataclass(frozen=True)
class LightingConfig:
    """The lamps of the room."""

    side: str = setting("cameras", "where the light comes from", choices=("cameras", "one_side"))
    shadows: bool = setting(False, "cast shadows")
    flicker: float = setting(0.0, "fraction by which the light flickers", "", (0.0, 1.0))
    flicker_hz: float = setting(100.0, "frequency of the flicker", "Hz", (0.0, 1000.0))


@dataclass(frozen=True)
class TrackConfig:
    """Where the train runs, and how fast. The controller is told none of this."""

    kind: str = setting("oval", "shape of the track", choices=TRACK_KINDS)
    semi_axes: tuple[float, ...] = setting(
        [0.16, 0.22], "half extents of oval, figure_eight", "m", (0.03, 1.0), shape=(2,)
    )
    radius: float = setting(0.12, "radius of a circle and of a stadium's ends", "m", (0.03, 1.0))
    straight: float = setting(0.20, "length of a stadium's straights", "m", (0.01, 2.0))
    length: float = setting(0.9, "length of a line", "m", (0.2, 5.0))
    csv: str = setting("", "file of a closed polyline: header x,y, metres in the world frame")
    centre: tuple[float, ...] = setting([0.56, 0.0], "centre of the track in the world", "m", (-2.0, 2.0), shape=(2,))
    rotation_deg: float = setting(0.0, "rotation of the track about its centre", "deg", (-360.0, 360.0))
    centre_range: float = setting(0.03, "the seed moves the centre by up to this in x and in y", "m", (0.0, 0.5))
    rotation_range_deg: float = setting(15.0, "the seed turns the track by up to this", "deg", (0.0, 180.0))
    speed: float = setting(0.15, "mean speed of the train", "m/s", (0.0, 1.0))
    speed_law: str = setting("constant", "how the speed varies", choices=("constant", "varying", "stop_and_go"))
    variation: float = setting(0.15, "fraction by which a varying speed rises and falls", "", (0.0, 0.9))
    direction: str = setting("random", "which way round", choices=("random", "forward", "backward"))
    start: float = setting(-1.0, "where it starts, as a fraction of the track; -1: drawn by the seed", "", (-1.0, 1.0))


@dataclass(frozen=True)
class TrainConfig:
    """What the train looks like."""

    body: str = setting("plain", "the body", choices=("plain", "striped", "round", "dark"))


@dataclass(frozen=True)
class CamerasConfig:
    """The two fixed cameras, left and right."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(30.0, "vertical field of view", "deg", (2.0, 120.0))
    distance: float = setting(1.4, "distance from look_at", "m", (0.3, 5.0))
    azimuth_deg: tuple[float, ...] = setting(
        [45.0, -45.0], "azimuths of left and right", "deg", (-180.0, 180.0), shape=(2,)
    )
    elevation_deg: float = setting(20.0, "elevation above look_at", "deg", (1.0, 89.0))
    look_at: tuple[float, ...] = setting([0.56, 0.0, 0.47], "the point both look at", "m", (-2.0, 3.0), shape=(3,))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    render_window: bool = setting(True, "render only the window of interest")
    calibration: str = setting("train_cameras.yaml", "file of the calibrated camera matrices")


@dataclass(frozen=True)
class BoardConfig:
    """The inclined board: where it stands, what is on it. The seed draws the rest."""

    incline_deg: float = setting(10.0, "angle of the board to the horizontal", "deg", (2.0, 30.0))
    length: float = setting(0.90, "along the slope", "m", (0.88, 1.5))
    width: float = setting(0.60, "across", "m", (0.56, 1.0))
    edge_position: tuple[float, ...] = setting(
        [0.55, 0.0, 0.50], "middle of the bottom edge in the world", "m", (-2.0, 2.0), shape=(3,)
    )
    placement_range: float = setting(0.01, "the seed moves it by up to this in x and in y", "m", (0.0, 0.1))
    rotation_range_deg: float = setting(2.0, "the seed turns it about the vertical by up to this", "deg", (0.0, 20.0))
    walls: bool = setting(True, "walls along the two long sides")
    peg_count: int = setting(-1, "pegs on the board; -1: 12 to 14, drawn by the seed", "", (-1, 40))
    knock_time: float = setting(0.0, "when somebody knocks against the board; 0: never", "s", (0.0, 3600.0))
    distractor: bool = setting(False, "a second thing moves behind the board")


@dataclass(frozen=True)
class BallConfig:
    """Where and when the ball is released."""

    start_x: float | None = setting(None, "place across the board; null: drawn by the seed", "m", (-0.22, 0.22))
    release: bool = setting(True, "whether the gate opens at all")


@dataclass(frozen=True)
class BoardCameraConfig:
    """The one camera, placed at random with the whole board in view."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(45.0, "vertical field of view", "deg", (2.0, 120.0))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    supersampling: int = setting(2, "side of the square of rendered pixels averaged into one", "", (1, 8))
    distance_range: tuple[float, ...] = setting([1.5, 1.9], "from the board's middle", "m", (0.5, 10.0), shape=(2,))
    azimuth_range_deg: float = setting(50.0, "to both sides of the slope's upward direction", "deg", (0.0, 180.0))
    elevation_range_deg: tuple[float, ...] = setting([40.0, 65.0], "above the horizon", "deg", (5.0, 85.0), shape=(2,))
    roll_range_deg: float = setting(5.0, "about the optical axis, to both sides", "deg", (0.0, 180.0))


@dataclass(frozen=True)
class OperatorConfig:
    """What a person does before the ball comes: marks the circles in the image, jogs the arm over the touch marks."""

    windows: tuple[tuple[float, ...], ...] = setting(
        [],
        "(u0, v0, width, height) around each circle; none: found by themselves",
        "px",
        (0.0, 4096.0),
        shape=(None, 4),
    )
    threshold: float = setting(110.0, "pixels in them that are no brighter are dark", "grey levels", (1.0, 254.0))
    placing_std: float = setting(0.0005, "error of the arm's tip over a mark, to each side", "m", (0.0, 0.01))
