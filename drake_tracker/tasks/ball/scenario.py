"""The settings of a run of the ball (Nashman and Chaconas 1990).

Settings that all tasks share are in `drake_tracker.scenarios.base`.
"""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.arm.config import HandKind, PacketGuardConfig, Puma560, ServoConfig
from drake_tracker.arm.description import ARMS, arms_without
from drake_tracker.core.setting import setting
from drake_tracker.core.timing import (
    BALL_SERVO_PERIOD,
    BALL_THROUGHPUT_CYCLES,
    BALL_TIME_STEP,
    BALL_UPDATE_CYCLES,
)
from drake_tracker.estimation.config import InclinedPlane
from drake_tracker.faults.kinds import faults_of
from drake_tracker.grasp.config import CatchConfig
from drake_tracker.link.config import Perfect
from drake_tracker.link.link import LINKS
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.tasks.plausible import Problems, image_problems, link_problems
from drake_tracker.vision.centroid.config import FrameDifference
from drake_tracker.vision.centroid.detectors import DETECTORS
from drake_tracker.world.config import BallConfig, BoardCameraConfig, BoardConfig, LightingConfig, OperatorConfig

STILL_SUPERSAMPLING = 4
"""Supersampling of the few images of the initialisation: more accurate than usual."""


@dataclass(frozen=True)
class BoardVisionConfig:
    """Settings of the vision: from the images of the single camera to points on the board.

    Attributes:
        centroid_height: height of the moving centroid over the board [m]; half the diameter of the ball is 0.02 m.
    """

    detector: DETECTORS.union() = setting(FrameDifference, "the motion detector")  # type: ignore[valid-type]
    follow: bool = setting(False, "search only near the position predicted from the last two measurements")
    update_cycles: int = setting(BALL_UPDATE_CYCLES, "time between two centroids", "cycles", (1, 60))
    throughput_cycles: int = setting(
        BALL_THROUGHPUT_CYCLES, "time from a centroid's first image until the centroid appears", "cycles", (2, 120)
    )
    centroid_height: ClassVar[float] = 0.0165
    """Height of the moving centroid over the board [m]; measured on rendered images (`benchmarks/ball_detectors.py`).
    Half the diameter of the ball, as in the paper, is 0.02 m."""
    bottom: float = setting(
        0.05, "width of the strip along the bottom edge in which motion is ignored", "m", (0.0, 0.4)
    )
    tolerance: float = setting(0.02, "largest error of a measurement before it is rejected", "m", (0.0, 0.2))


@dataclass(frozen=True)
class BallScenario(BaseScenario):
    """All settings of a run of the ball.

    Attributes:
        hand: the hand that the task needs.
    """

    COMMON: ClassVar[tuple[str, ...]] = (
        *("duration", "seed", "board.incline_deg", "board.length", "board.width", "board.walls", "board.peg_count"),
        *("ball.start_x", "ball.release", "camera.noise", "camera.render_processes", "lighting.shadows"),
        *("operator.windows", "vision.detector", "vision.detector.threshold", "vision.follow"),
        *("vision.update_cycles", "vision.throughput_cycles"),
        *("estimator.gate", "estimator.restitution", "link", "link.drop", "link.delay"),
        *("catch.follow", "catch.ready_after", "arm", "faults"),
    )
    LAG_KEY: ClassVar[str] = "vision.throughput_cycles"
    hand: ClassVar[HandKind] = HandKind.CUP
    task: str = setting("ball", "name of the task")
    duration: float = setting(15.0, "simulated time after which the run ends", "s", (0.01, 36000.0))
    time_step: float = setting(BALL_TIME_STEP, "step of the plant", "s", (0.0001, 0.01))
    board: BoardConfig = setting(BoardConfig, "the board and its pegs")
    ball: BallConfig = setting(BallConfig, "the ball")
    camera: BoardCameraConfig = setting(BoardCameraConfig, "the camera")
    lighting: LightingConfig = setting(LightingConfig, "the lamps")
    operator: OperatorConfig = setting(OperatorConfig, "work of a person before the run")
    vision: BoardVisionConfig = setting(BoardVisionConfig, "from images to points")
    estimator: InclinedPlane = setting(InclinedPlane, "from points to the predicted path")
    link: LINKS.union() = setting(  # type: ignore[valid-type]
        Perfect, "from the host to the controller of the arm"
    )
    guard: PacketGuardConfig = setting(PacketGuardConfig, "which packets the arm follows")
    servo: ServoConfig = setting(ServoConfig, "from packets of predicted path to set-points every 5 ms")
    catch: CatchConfig = setting(CatchConfig, "motions of the hand, and their conditions")
    arm: ARMS.union(Custom, without=arms_without(HandKind.CUP)) = setting(  # type: ignore[valid-type]
        Puma560, "the arm"
    )
    faults: tuple[faults_of("ball"), ...] = setting([], "injected faults, with their times")  # type: ignore[valid-type]

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key path, what is required)."""
        found = self.timing_problems(BALL_SERVO_PERIOD)
        for key in ("distance_range", "elevation_range_deg"):
            low, high = getattr(self.camera, key)
            if low > high:
                found.append((f"camera.{key}", "must give the lower end first"))
        if (self.vision.detector.smoothing_size or 1) % 2 == 0:
            found.append(("vision.detector.smoothing_size", "must be odd"))
        if self.catch.settle_tolerance < self.catch.follow_tolerance:
            found.append(("catch.settle_tolerance", "must not be below catch.follow_tolerance"))
        found += catch_problems(self)
        camera = self.camera
        rendered = max(camera.supersampling, STILL_SUPERSAMPLING)
        found += image_problems("camera", camera.width, camera.height, supersampling=rendered)
        for number, fault in enumerate(self.faults):
            if getattr(fault, "camera", "both") != "both":
                found.append((f"faults[{number}].camera", "must be both: the ball has one camera"))
        return found


def catch_problems(scenario: BallScenario) -> Problems:
    """Returns the settings of the catch that contradict vision, the link, or each other.

    Args:
        scenario: of the ball.
    """
    catch, lag = scenario.catch, scenario.lag
    found = link_problems(scenario, scenario.link)
    if not found and lag >= catch.trust_time:
        words = (
            f"leaves no prediction to trust: each is {lag:.3g} s old when it arrives, and the longest age is "
            f"{catch.trust_time:g} s"
        )
        found.append((scenario.LAG_KEY, words))
    return found
