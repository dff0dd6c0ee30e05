"""The settings of a run of the ball (Nashman and Chaconas 1990); `scenarios.base` has what all tasks share."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.arm.config import Hand, Puma560, ServoConfig
from drake_tracker.arm.kinds import ARMS, arms_without
from drake_tracker.core.setting import setting
from drake_tracker.core.timing import (
    BALL_SERVO_PERIOD,
    BALL_THROUGHPUT_CYCLES,
    BALL_TIME_STEP,
    BALL_UPDATE_CYCLES,
)
from drake_tracker.estimation.config import Slope
from drake_tracker.grasp.config import CatchConfig
from drake_tracker.link.config import Perfect
from drake_tracker.link.kinds import LINKS
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.vision.config import FrameDifference
from drake_tracker.vision.detectors import DETECTORS
from drake_tracker.world.config import BallConfig, BoardCameraConfig, BoardConfig, LightingConfig, OperatorConfig


@dataclass(frozen=True)
class BoardVisionConfig:
    """From the images of the one camera to points on the board."""

    detector: DETECTORS.union() = setting(FrameDifference, "the motion detector")  # type: ignore[valid-type]
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


@dataclass(frozen=True)
class BallScenario(BaseScenario):
    """A run of the ball, complete."""

    hand: ClassVar[Hand] = Hand.CUP
    task: str = setting("ball", "the task")
    duration: float = setting(15.0, "simulated time after which the run ends", "s", (0.01, 36000.0))
    time_step: float = setting(BALL_TIME_STEP, "step of the plant", "s", (0.0001, 0.01))
    board: BoardConfig = setting(BoardConfig, "the board")
    ball: BallConfig = setting(BallConfig, "the ball")
    camera: BoardCameraConfig = setting(BoardCameraConfig, "the camera")
    lighting: LightingConfig = setting(LightingConfig, "the light")
    operator: OperatorConfig = setting(OperatorConfig, "what a person does before the ball comes")
    vision: BoardVisionConfig = setting(BoardVisionConfig, "from images to points")
    estimator: Slope = setting(Slope, "from points to predicted path")
    link: LINKS.union() = setting(  # type: ignore[valid-type]
        Perfect, "from the host to the arm's controller"
    )
    servo: ServoConfig = setting(ServoConfig, "from packets to a pose every 5 ms")
    catch: CatchConfig = setting(CatchConfig, "what the hand does next")
    arm: ARMS.union(Custom, without=arms_without(Hand.CUP)) = setting(  # type: ignore[valid-type]
        Puma560, "the arm"
    )

    def problems(self) -> list[tuple[str, str]]:
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
