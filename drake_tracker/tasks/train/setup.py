"""A resolved run of the train: everything that follows from the settings of a scenario, each value computed once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drake_tracker.arm.description import ArmDescription
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.faults.fault import Fault, calibrated_with
from drake_tracker.faults.kinds import make_faults
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.calibrated import calibrated_cameras
from drake_tracker.tasks.train.reach import Reach
from drake_tracker.tasks.train.scenario import Measured, Rendered, TrainScenario, grasp_of
from drake_tracker.tasks.train.track_placement import place_track
from drake_tracker.vision.centroid.config import MotionCentroid
from drake_tracker.vision.region_of_interest import RegionOfInterest, project_region
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.world.config import WristCamera
from drake_tracker.world.imaging.cameras import ImageWindow, camera_poses, renderable_window
from drake_tracker.world.imaging.image_pipeline import MOST_LATENCY, ImagePipeline, process_count
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA
from drake_tracker.world.train.plant import TRAIN_HEIGHT
from drake_tracker.world.train.tracks import Track


@dataclass(frozen=True, eq=False)
class TrainSetup:
    """A resolved scenario of the train. Everything but the settings is computed when it is first read.

    Each attribute raises DrakeTrackerError when the scenario cannot be built in this respect: a file is missing, a
    custom arm is not allowed, or the arm cannot reach the pose in which it waits.

    Attributes:
        scenario: the settings.
    """

    scenario: TrainScenario

    @property
    def several(self) -> bool:
        """Whether vision, rendered or measured, tracks several objects."""
        return isinstance(self.scenario.vision.method, (SilhouetteTracker, SeveralObjects))

    @property
    def measured(self) -> bool:
        """Whether the points of vision are the truth with the measured error, instead of coming from images."""
        return isinstance(self.scenario.vision, Measured)

    @property
    def rendered(self) -> Rendered:
        """The settings of a vision on rendered images. Raises DrakeTrackerError when there are no images."""
        if not isinstance(self.scenario.vision, Rendered):
            raise DrakeTrackerError(f"{self.scenario.where('vision')} must be !Rendered: this needs images")
        return self.scenario.vision

    @property
    def has_wrist(self) -> bool:
        """Whether the hand carries a camera."""
        return isinstance(self.scenario.cameras.wrist, WristCamera)

    @cached_property
    def sees_hand(self) -> bool:
        """Whether vision measures the hand by its markers."""
        return not self.measured and self.arm.markers

    @property
    def arm_signals(self) -> tuple[str, ...]:
        """The outputs of the arm that vision reads, to mask the arm and to know where a camera on the hand is."""
        return ("arm_state", "jaws") if isinstance(self.scenario.vision.method, SilhouetteTracker) else ()

    @property
    def update_cycles(self) -> int:
        """Cycles from one pair of images that vision looks at to the next."""
        method = self.scenario.vision.method
        return method.update_cycles if isinstance(method, SilhouetteTracker) else 1

    @cached_property
    def arm(self) -> ArmDescription:
        """The arm and its hand."""
        return arm_of(self.scenario)

    @cached_property
    def home(self) -> np.ndarray:
        """The reference (x, y, z, yaw) in W over which the hand waits [m, rad], shape (4,).

        It is the middle of the work volume at the train's height. The yaw places joint 6 near the middle of its range.
        """
        low, high = np.array(self.scenario.vision.work_volume)
        middle = 0.5 * (low + high)
        return np.array([middle[0], middle[1], self.scenario.table_height + TRAIN_HEIGHT, np.pi])

    @cached_property
    def grasp(self) -> GraspConfig:
        """The settings of the grasp, with the size of the object that is grasped."""
        return grasp_of(self.scenario)

    @cached_property
    def reach(self) -> Reach:
        """The controller's model of the arm, the joints at the start, and the reach of the arm."""
        return Reach(self.arm, self.home, self.grasp)

    @cached_property
    def placement(self) -> tuple[Track, float]:
        """(track in the direction of travel, arc length at which the train starts [m])."""
        return place_track(self.scenario, None if self.scenario.track.kind == "csv" else self.reach)

    @property
    def track(self) -> Track:
        """The track in the direction of travel."""
        return self.placement[0]

    @cached_property
    def faults(self) -> tuple[Fault, ...]:
        """The injected faults."""
        scenario = self.scenario
        if not scenario.faults:
            return ()
        poses = camera_poses(scenario.cameras)
        return make_faults(
            scenario.faults,
            seed=scenario.seed,
            lag=scenario.vision.lag_cycles * VISION_PERIOD,
            table_height=scenario.table_height,
            work_volume=scenario.vision.work_volume,
            X_WCs={name.removeprefix("camera_"): X_WC.GetAsMatrix4() for name, X_WC in poses.items()},
            servo_inertia=self.arm.servo_inertia,
            finger_stiffness=self.arm.finger_stiffness,
            time_step=scenario.time_step,
        )

    @cached_property
    def calibrated(self) -> dict[str, CameraModel]:
        """{side: camera} of the calibration file."""
        return calibrated_cameras(self.scenario)

    @cached_property
    def cameras(self) -> dict[str, CameraModel]:
        """{side: camera as the controller knows it}: the calibrated one, with faults of the calibration."""
        return calibrated_with(self.faults, self.calibrated)

    @cached_property
    def search_windows(self) -> dict[str, RegionOfInterest]:
        """{side: window in which vision searches for objects}: it shows objects at the border of the volume whole."""
        vision = self.scenario.vision
        margin = vision.method.margin if isinstance(vision.method, SilhouetteTracker) else 0.0
        volume = np.add(vision.work_volume, margin * np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]))
        return {side: project_region(self.cameras[side], volume, vision.outline) for side in SIDES}

    @cached_property
    def windows(self) -> dict[str, ImageWindow]:
        """{side: window of the full image that is rendered}: all of it if vision must see the hand."""
        config = self.scenario.cameras
        if not config.render_window or self.sees_hand:
            return dict.fromkeys(SIDES, (0, 0, config.width, config.height))
        windows = self.search_windows
        return {side: renderable_window(windows[side].bounds, config.width, config.height) for side in SIDES}

    @cached_property
    def image_sizes(self) -> dict[str, tuple[int, int]]:
        """{name of the port: (width, height) [px]} of all images that vision reads."""
        sizes = {f"camera_{side}": window[2:] for side, window in self.windows.items()}
        wrist = self.scenario.cameras.wrist
        return sizes | ({WRIST_CAMERA: (wrist.width, wrist.height)} if isinstance(wrist, WristCamera) else {})

    @cached_property
    def pipeline(self) -> ImagePipeline | None:
        """How the images are made beside the simulation; None: they are rendered when they are read.

        The lag of the vision hides the latency of the images, which may take up the whole lag but one cycle. A vision
        of several objects describes its newest image, a motion detector the middle one of three.
        """
        if self.measured:
            return None
        processes = process_count(self.scenario.cameras.render_processes)
        method = self.rendered.method
        newest = method.detector.resolve().stride if isinstance(method, MotionCentroid) else 0
        latency = min(self.scenario.vision.lag_cycles - newest - 1, MOST_LATENCY)
        if processes == 0 or latency <= 0:
            return None
        return ImagePipeline(latency, processes, lambda cycle: cycle % self.update_cycles == 0)

    @property
    def image_latency(self) -> int:
        """Cycles from the capture of an image until vision sees it."""
        return 0 if self.pipeline is None else self.pipeline.latency


def resolve(scenario: BaseScenario) -> TrainSetup:
    """Returns the resolved scenario of the train.

    Args:
        scenario: the settings.

    Raises DrakeTrackerError when the scenario belongs to another task.
    """
    if not isinstance(scenario, TrainScenario):
        raise DrakeTrackerError(f"{scenario.where('task')} = {scenario.task}: this needs a scenario of the train")
    return TrainSetup(scenario)
