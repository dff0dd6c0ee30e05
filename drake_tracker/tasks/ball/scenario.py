"""Everything a run of the ball can be told (Nashman and Chaconas 1990); `parts` has what it shares with other tasks."""

from dataclasses import dataclass
from typing import Optional, Union

from drake_tracker.core.setting import setting
from drake_tracker.core.timing import (
    BALL_SERVO_PERIOD,
    BALL_THROUGHPUT_CYCLES,
    BALL_TIME_STEP,
    BALL_UPDATE_CYCLES,
)
from drake_tracker.scenarios.parts import BaseScenario, Custom, Lighting, Lossy, NormalFlow, Perfect, Puma560, Servo


@dataclass
class Board:
    """The inclined board: where it stands, what is on it. The seed draws the rest."""

    incline_deg: float = setting(10.0, "angle of the board to the horizontal", "deg", (2.0, 30.0))
    length: float = setting(0.90, "along the slope", "m", (0.88, 1.5))
    width: float = setting(0.60, "across", "m", (0.56, 1.0))
    edge_position: list[float] = setting(
        [0.55, 0.0, 0.50], "middle of the bottom edge in the world", "m", (-2.0, 2.0), shape=(3,)
    )
    placement_range: float = setting(0.01, "the seed moves it by up to this in x and in y", "m", (0.0, 0.1))
    rotation_range_deg: float = setting(2.0, "the seed turns it about the vertical by up to this", "deg", (0.0, 20.0))
    walls: bool = setting(True, "walls along the two long sides")
    peg_count: int = setting(-1, "pegs on the board; -1: 12 to 14, drawn by the seed", "", (-1, 40))
    knock_time: float = setting(0.0, "when somebody knocks against the board; 0: never", "s", (0.0, 3600.0))
    distractor: bool = setting(False, "a second thing moves behind the board")


@dataclass
class Ball:
    """Where and when the ball is released."""

    start_x: Optional[float] = setting(None, "place across the board; null: drawn by the seed", "m", (-0.22, 0.22))
    release: bool = setting(True, "whether the gate opens at all")


@dataclass
class BoardCamera:
    """The one camera, placed at random with the whole board in view."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(45.0, "vertical field of view", "deg", (2.0, 120.0))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    supersampling: int = setting(2, "side of the square of rendered pixels averaged into one", "", (1, 8))
    distance_range: list[float] = setting([1.5, 1.9], "from the board's middle", "m", (0.5, 10.0), shape=(2,))
    azimuth_range_deg: float = setting(50.0, "to both sides of the slope's upward direction", "deg", (0.0, 180.0))
    elevation_range_deg: list[float] = setting([40.0, 65.0], "above the horizon", "deg", (5.0, 85.0), shape=(2,))
    roll_range_deg: float = setting(5.0, "about the optical axis, to both sides", "deg", (0.0, 180.0))


@dataclass
class Operator:
    """What a person does before the ball comes: marks the circles in the image, jogs the arm over the touch marks."""

    windows: list[list[float]] = setting(
        [],
        "(u0, v0, width, height) around each circle; none: found by themselves",
        "px",
        (0.0, 4096.0),
        shape=(None, 4),
    )
    threshold: float = setting(110.0, "pixels in them that are no brighter are dark", "grey levels", (1.0, 254.0))
    placing_std: float = setting(0.0005, "error of the arm's tip over a mark, to each side", "m", (0.0, 0.01))


@dataclass
class BinaryImage:
    """What all detectors share that make a binary image."""

    smoothing_size: int = setting(3, "side of the Gaussian mask, odd", "px", (1, 31))
    smoothing_sigma: float = setting(1.0, "standard deviation of the Gaussian", "px", (0.1, 10.0))
    min_pixels: int = setting(6, "white pixels that make a valid centroid", "px", (1, 65536))
    centroid: str = setting("hull", "mean of the white pixels, or of their convex hull", choices=("mean", "hull"))
    join_distance: int = setting(12, "gap across which the hull joins fragments", "px", (1, 512))


@dataclass
class FrameDifference(BinaryImage):
    """Two consecutive images subtracted: the method that the paper chose."""

    stride: int = setting(2, "cycles between the two images; 2 as interlaced, 1 every one", "cycles", (1, 4))
    threshold: float = setting(5.0, "change that counts as motion", "grey levels", (1.0, 255.0))
    normalise_gain: bool = setting(True, "take out changes of the whole image's brightness; the paper does not")


@dataclass
class BackgroundDifference(BinaryImage):
    """The difference from an image without the ball, taken with the gate open: the paper dropped it."""

    threshold: float = setting(5.0, "difference that counts as the ball", "grey levels", (1.0, 255.0))


@dataclass
class StaticThreshold(BinaryImage):
    """A plain threshold of the image: cannot find white on white, as the paper says."""

    level: float = setting(200.0, "pixels that are brighter are taken for the ball", "grey levels", (0.0, 255.0))


@dataclass
class BoardVision:
    """From the images of the one camera to points on the board."""

    detector: Union[FrameDifference, NormalFlow, BackgroundDifference, StaticThreshold] = setting(
        FrameDifference, "the motion detector"
    )
    follow: bool = setting(False, "look only around where the last two readings lead, the paper's alternative")
    update_cycles: int = setting(BALL_UPDATE_CYCLES, "cycles from one centroid to the next", "cycles", (1, 60))
    throughput_cycles: int = setting(
        BALL_THROUGHPUT_CYCLES, "cycles from a centroid's first image until it shows", "cycles", (2, 120)
    )
    centroid_height: float = setting(
        0.0165, "height over the board at which the moving centroid lies; 0.02 is half the diameter", "m", (0.0, 0.04)
    )
    bottom: float = setting(0.05, "strip along the bottom edge in which nothing is looked for", "m", (0.0, 0.4))
    tolerance: float = setting(0.02, "error of a reading allowed before it is called spurious", "m", (0.0, 0.2))


@dataclass
class Slope:
    """A filter of a ball that rolls down the board, and where it comes out."""

    sigma: float = setting(0.0025, "noise of a point, per axis", "m", (0.00001, 0.1))
    process_noise: float = setting(0.03, "how the speed wanders", "m/s/sqrt(s)", (1e-6, 10.0))
    hit_speed: float = setting(0.4, "change of speed that a peg may cause, per axis", "m/s", (0.001, 10.0))
    gate: float = setting(3.5, "deviations from what is expected that tell of a hit", "", (0.5, 20.0))
    restitution: float = setting(0.5, "of the walls", "", (0.0, 1.0))


@dataclass
class Catch:
    """The motor schema of catching. Heights are of the cup's rim above the ball's centre where it leaves the board."""

    follow: bool = setting(True, "whether the cup follows the foreseen crossing; else it stays in the middle")
    beyond: float = setting(0.050, "horizontal distance from the edge to the middle of the cup", "m", (0.0, 0.2))
    rim_height: float = setting(-0.035, "height of the rim while it waits", "m", (-0.1, 0.02))
    raised_height: float = setting(0.085, "height of the rim once it holds the ball", "m", (0.0, 0.4))
    home_duration: float = setting(1.0, "time to go to the middle of the edge", "s", (0.2, 10.0))
    raise_duration: float = setting(0.6, "time in which the cup is raised", "s", (0.2, 10.0))
    stop_duration: float = setting(0.2, "time in which the operator's stop brings the hand to rest", "s", (0.05, 2.0))
    shortest_motion: float = setting(0.15, "shortest time of a correction", "s", (0.02, 2.0))
    hand_speed: float = setting(0.75, "greatest speed of the hand along the edge", "m/s", (0.05, 3.0))
    hand_acceleration: float = setting(10.0, "greatest acceleration of the hand", "m/s^2", (0.1, 100.0))
    manual_speed: float = setting(0.25, "speed of the hand when the operator has taken over", "m/s", (0.01, 1.0))
    follow_tolerance: float = setting(0.002, "a crossing that moved by less is still the same", "m", (0.0, 0.05))
    settle_time: float = setting(0.10, "time before the ball comes from which the cup stands still", "s", (0.0, 1.0))
    settle_tolerance: float = setting(0.006, "a crossing that moved by more is followed even then", "m", (0.0, 0.1))
    rest_time: float = setting(0.4, "time after which a ball has come to rest in the cup", "s", (0.05, 5.0))
    trust_time: float = setting(0.45, "age up to which a foreseen crossing is believed", "s", (0.05, 5.0))
    ready_after: float = setting(0.3, "time of waiting in place after which the arm is ready", "s", (0.0, 10.0))


@dataclass
class SevenJoint:
    """An arm with seven joints, with the kinematics of the Robotics Research K-1607."""


@dataclass
class BallScenario(BaseScenario):
    """A run of the ball, complete."""

    task: str = setting("ball", "what is to be done", choices=("train", "ball"))
    duration: float = setting(15.0, "simulated time after which the run ends", "s", (0.01, 36000.0))
    time_step: float = setting(BALL_TIME_STEP, "step of the plant", "s", (0.0001, 0.01))
    board: Board = setting(Board, "the board")
    ball: Ball = setting(Ball, "the ball")
    camera: BoardCamera = setting(BoardCamera, "the camera")
    lighting: Lighting = setting(Lighting, "the light")
    operator: Operator = setting(Operator, "what a person does before the ball comes")
    vision: BoardVision = setting(BoardVision, "from images to points")
    estimator: Slope = setting(Slope, "from points to predicted path")
    link: Union[Perfect, Lossy] = setting(Perfect, "from the host to the arm's controller")
    servo: Servo = setting(Servo, "from packets to a pose every 5 ms")
    catch: Catch = setting(Catch, "what the hand does next")
    arm: Union[Puma560, SevenJoint, Custom] = setting(Puma560, "the arm")

    def problems(self):
        """Returns the settings that contradict each other: a list of (key, what is wrong and what to do)."""
        found = self.timing_problems(BALL_SERVO_PERIOD)
        for key in ("distance_range", "elevation_range_deg"):
            low, high = getattr(self.camera, key)
            if low > high:
                found.append((f"camera.{key}", "must have its lower end first"))
        if (self.vision.detector.smoothing_size or 1) % 2 == 0:
            found.append(("vision.detector.smoothing_size", "must be odd"))
        if self.catch.settle_tolerance < self.catch.follow_tolerance:
            found.append(("catch.settle_tolerance", "must not be below catch.follow_tolerance"))
        return found
