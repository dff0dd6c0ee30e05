"""Everything a run of the ball can be told (Nashman and Chaconas 1990); `parts` has what it shares with other tasks."""

from dataclasses import dataclass
from typing import Union

from drake_tracker.scenarios.parts import BaseScenario, Lighting, Lossy, Perfect, Puma560, Servo
from drake_tracker.scenarios.setting import setting
from drake_tracker.timing import BALL_SERVO_PERIOD, BALL_TIME_STEP


@dataclass
class Board:
    """The inclined board: where it stands, what is on it. The seed draws the rest."""

    incline_deg: float = setting(10.0, "angle of the board to the horizontal", "deg", (2.0, 30.0))
    length: float = setting(0.90, "along the slope", "m", (0.4, 1.5))
    width: float = setting(0.60, "across", "m", (0.3, 1.0))
    edge_position: list[float] = setting(
        [0.55, 0.0, 0.50], "middle of the bottom edge in the world", "m", (-2.0, 2.0), shape=(3,)
    )
    placement_range: float = setting(0.01, "the seed moves it by up to this in x and in y", "m", (0.0, 0.1))
    rotation_range_deg: float = setting(2.0, "the seed turns it about the vertical by up to this", "deg", (0.0, 20.0))
    walls: bool = setting(True, "walls along the two long sides")
    peg_count: int = setting(-1, "pegs on the board; -1: 12 to 14, drawn by the seed", "", (-1, 40))
    placing_std: float = setting(0.0005, "error of the operator who places the tool above a mark", "m", (0.0, 0.01))
    knock_time: float = setting(0.0, "when somebody knocks against the board; 0: never", "s", (0.0, 3600.0))
    distractor: bool = setting(False, "a second thing moves behind the board")


@dataclass
class Ball:
    """Where and when the ball is released."""

    start: float = setting(-1.0, "place along the top edge, 0 left to 1 right; -1: drawn by the seed", "", (-1.0, 1.0))
    release: bool = setting(True, "whether the gate opens at all")


@dataclass
class BoardCamera:
    """The one camera, placed at random with the whole board in view."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(45.0, "vertical field of view", "deg", (2.0, 120.0))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    distance_range: list[float] = setting([1.5, 1.9], "from the board's middle", "m", (0.5, 10.0), shape=(2,))
    azimuth_range_deg: float = setting(50.0, "to both sides of the slope's upward direction", "deg", (0.0, 180.0))
    elevation_range_deg: list[float] = setting([40.0, 65.0], "above the horizon", "deg", (5.0, 85.0), shape=(2,))
    roll_range_deg: float = setting(5.0, "about the optical axis, to both sides", "deg", (0.0, 180.0))


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
    link: Union[Perfect, Lossy] = setting(Perfect, "from the host to the arm's controller")
    servo: Servo = setting(Servo, "from packets to a pose every 5 ms")
    arm: Puma560 = setting(Puma560, "the arm")

    def problems(self):
        """Returns the settings that contradict each other: a list of (key, what is wrong and what to do)."""
        return self.timing_problems(BALL_SERVO_PERIOD)
