"""The settings of a run of the train; `scenarios.base` has what all tasks share."""

import math
from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.arm.config import Hand, Puma560, ServoConfig
from drake_tracker.arm.kinds import ARMS, arms_without
from drake_tracker.core.setting import setting
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.estimation.config import ClosedPath
from drake_tracker.estimation.kinds import ESTIMATORS, SURFACE_ESTIMATORS
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.link.config import Perfect
from drake_tracker.link.kinds import LINKS
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.vision.config import NormalFlow
from drake_tracker.world.config import CamerasConfig, LightingConfig, TrackConfig, TrainConfig

WORK_VOLUME = ((0.33, -0.30, 0.45), (0.79, 0.30, 0.505))


@dataclass(frozen=True)
class Rendered:
    """Vision on the rendered images of both cameras."""

    detector: NormalFlow = setting(NormalFlow, "the motion detector")
    lag_cycles: int = setting(15, "cycles from the middle image's capture to its centroid", "cycles", (1, 120))
    work_volume: tuple[tuple[float, ...], ...] = setting(
        WORK_VOLUME,
        "lowest and highest corner of the box in which motion is looked for",
        "m",
        (-5.0, 5.0),
        shape=(2, 3),
    )
    outline: str = setting("ellipse", "of that box seen from above: whole, or its ellipse", choices=("box", "ellipse"))


@dataclass(frozen=True)
class Measured:
    """The train's true place with the error that was measured in the camera loop: no image is rendered."""

    file: str = setting("train_vision.yaml", "file of the measured error, made by drake-tracker measure")
    lag_cycles: int = setting(15, "cycles from capture to point; below 2 no camera could", "cycles", (0, 120))
    work_volume: tuple[tuple[float, ...], ...] = setting(
        WORK_VOLUME, "lowest and highest corner of the box in which the train is seen", "m", (-5.0, 5.0), shape=(2, 3)
    )
    outline: str = setting(
        "ellipse", "of that box from above, where the track must lie: whole, or its ellipse", choices=("box", "ellipse")
    )


@dataclass(frozen=True)
class TrainScenario(BaseScenario):
    """A run of the train, complete."""

    hand: ClassVar[Hand] = Hand.GRIPPER
    task: str = setting("train", "the task")
    table_height: float = setting(0.45, "height of the table's top", "m", (0.0, 1.5))
    track: TrackConfig = setting(TrackConfig, "the track")
    train: TrainConfig = setting(TrainConfig, "the train")
    lighting: LightingConfig = setting(LightingConfig, "the light")
    cameras: CamerasConfig = setting(CamerasConfig, "the cameras")
    vision: Rendered | Measured = setting(Rendered, "from images to points")
    estimator: ESTIMATORS.union(Custom, without=SURFACE_ESTIMATORS) = setting(  # type: ignore[valid-type]
        ClosedPath, "from points to predicted path"
    )
    link: LINKS.union() = setting(  # type: ignore[valid-type]
        Perfect, "from the host to the arm's controller"
    )
    servo: ServoConfig = setting(ServoConfig, "from packets to a pose every 30 ms")
    grasp: GraspConfig = setting(GraspConfig, "what the hand does next")
    arm: ARMS.union(Custom, without=arms_without(Hand.GRIPPER)) = setting(  # type: ignore[valid-type]
        Puma560, "the arm"
    )

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key, what is wrong and what to do)."""
        found = self.timing_problems(SERVO_PERIOD)
        if self.track.kind == "csv" and not self.track.csv:
            found.append(("track.csv", "must name a file when track.kind is csv"))
        if self.track.csv and self.track.kind != "csv":
            found.append(("track.kind", f"must be csv when track.csv names a file, not {self.track.kind}"))
        if -1.0 < self.track.start < 0.0:
            found.append(("track.start", "must be -1 (drawn by the seed) or a fraction from 0 to 1"))
        low, high = self.vision.work_volume
        if not all(a < b for a, b in zip(low, high)):
            found.append(("vision.work_volume", "must have its lowest corner first, then its highest"))
        if isinstance(self.vision, Rendered) and (self.vision.detector.smoothing_size or 1) % 2 == 0:
            found.append(("vision.detector.smoothing_size", "must be odd"))
        left, right = self.cameras.azimuth_deg
        if math.isclose(left, right, abs_tol=1.0):
            found.append(("cameras.azimuth_deg", "must differ by more than 1 deg, or there is no baseline"))
        return found
