"""A resolved run of the conveyor: everything that follows from a scenario, each value computed once."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drake_tracker.arm.arm_model import ArmModel, make_arm_model, tool_down
from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.transform_equation import surface_normal
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.faults.fault import Fault
from drake_tracker.faults.kinds import make_faults
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.calibrated import calibrated_cameras
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario, Measured, Rendered
from drake_tracker.vision.parts.part_vision_diagram import belt_window, camera_over_belt
from drake_tracker.world.conveyor.arrivals import Arrival, draw_arrivals
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import cell_centres
from drake_tracker.world.imaging.cameras import ImageWindow, renderable_window
from drake_tracker.world.imaging.image_pipeline import MOST_LATENCY, ImagePipeline, process_count

CELL_YAW = 0.5 * np.pi
"""Direction of x_P of a part in its cell [rad]: the jaws open across the columns, where neighbours leave room."""
PART_HEIGHT = 0.015
"""Height of the origin of a part above the belt, for the pose in which the hand waits [m]."""
BEFORE = 0.07
"""Length of the belt before its entry and beyond its end that the cameras look at [m]: a part that arrives is whole."""
HIGHEST = max(shape.height for shape in PART_SHAPES.values())
"""Height of the highest part [m]."""


@dataclass(frozen=True, eq=False)
class ConveyorSetup:
    """A resolved scenario of the conveyor. Everything but the settings is computed when it is first read.

    Attributes:
        scenario: the settings.
    """

    scenario: ConveyorScenario

    @property
    def measured(self) -> bool:
        """Whether vision reads the truth, instead of images."""
        return isinstance(self.scenario.vision, Measured)

    @property
    def rendered(self) -> Rendered:
        """The settings of a vision on rendered images. Raises DrakeTrackerError when there are no images."""
        if not isinstance(self.scenario.vision, Rendered):
            raise DrakeTrackerError("vision of the run is measured, so that there are no images; use --from points")
        return self.scenario.vision

    @cached_property
    def arm(self) -> ArmDescription:
        """The arm and its hand. Raises DrakeTrackerError when a custom arm cannot be used."""
        return arm_of(self.scenario)

    @cached_property
    def model(self) -> ArmModel:
        """The controller's model of the arm."""
        return make_arm_model(self.arm)

    @property
    def home(self) -> np.ndarray:
        """The reference (x, y, z, yaw) in W over which the hand waits [m, rad], shape (4,)."""
        y, z = self.scenario.window.y_wait, self.scenario.belt.height + PART_HEIGHT
        return self.scenario.belt.frame.to_world(np.array([[self.scenario.belt.middle, y, z, CELL_YAW]]))[0]

    @cached_property
    def q_initial(self) -> np.ndarray:
        """Joints over ``home``, with the tool square to the belt at the hover height [rad], shape (n,)."""
        slope, height = self.scenario.belt.frame.slope, self.scenario.pick.hover_height
        over_home = tool_down(self.home[:3] + height * surface_normal(slope), self.home[3], slope)
        q = joints_for(self.model, self.arm.q_start, over_home)
        q[-1] = math.remainder(q[-1], math.pi)  # jaws are the same after half a turn
        return q

    @cached_property
    def faults(self) -> tuple[Fault, ...]:
        """The injected faults."""
        scenario = self.scenario
        if not scenario.faults:
            return ()
        return make_faults(
            scenario.faults,
            seed=scenario.seed,
            servo_inertia=self.arm.servo_inertia,
            finger_stiffness=self.arm.finger_stiffness,
            time_step=scenario.time_step,
            belt_middle=scenario.belt.middle,
            belt_height=scenario.belt.height,
        )

    @cached_property
    def arrivals(self) -> tuple[Arrival, ...]:
        """The parts that arrive in the run, in the order of their arrival."""
        scenario, motion = self.scenario, make_belt_motion(self.scenario.belt)
        return draw_arrivals(
            scenario.arrivals, belt=scenario.belt, motion=motion, duration=scenario.duration, seed=scenario.seed
        )

    @property
    def filling_order(self) -> list[int]:
        """The numbers of the cells in the order in which they are filled.

        The tray that is nearer to the waiting hand comes first. In a tray, y decreases from row to row: the jaws hold
        an ell beside its middle, and stand over the edge of the next cell towards -y, which must still be empty.
        """
        x, y = cell_centres(self.scenario.tray).T
        farther = np.abs(np.sign(y) - np.sign(self.scenario.window.y_wait)) > 1.0
        return np.lexsort((x, -y.round(6), farther)).tolist()

    @cached_property
    def cameras(self) -> dict[str, CameraModel]:
        """{side: calibrated camera}. Raises DrakeTrackerError when the calibration file cannot be used."""
        return calibrated_cameras(self.scenario)

    @property
    def belt_cameras(self) -> dict[str, CameraModel]:
        """{side: calibrated camera as seen from the frame of the belt}."""
        return {side: camera_over_belt(camera, self.scenario.belt.frame) for side, camera in self.cameras.items()}

    @property
    def seen_belt(self) -> np.ndarray:
        """The lowest and the highest corner (x, y) in W of the belt that the cameras look at, shape (2, 2) [m]."""
        return self.belt_between(self.scenario.belt.entry - BEFORE, self.scenario.belt.end)

    def belt_between(self, first: float, last: float) -> np.ndarray:
        """Returns the lowest and the highest corner (x, y) in W of a piece of belt, shape (2, 2) [m].

        Args:
            first: y at which it begins [m].
            last: y at which it ends [m].
        """
        half = 0.5 * self.scenario.belt.width
        return np.array([[self.scenario.belt.middle - half, first], [self.scenario.belt.middle + half, last]])

    @cached_property
    def windows(self) -> dict[str, ImageWindow]:
        """{side: window of the full image that is rendered}."""
        config = self.scenario.cameras
        if not config.render_window:
            return dict.fromkeys(SIDES, (0, 0, config.width, config.height))
        belt, height = self.seen_belt, self.scenario.belt.height
        return {
            side: renderable_window(belt_window(camera, belt, height).bounds, config.width, config.height)
            for side, camera in self.belt_cameras.items()
        }

    @cached_property
    def pipeline(self) -> ImagePipeline | None:
        """How the images are made beside the simulation; None: they are rendered when they are read.

        The lag of the vision hides the latency of the images, which may take up the whole lag but one cycle.
        """
        vision = self.scenario.vision
        if not isinstance(vision, Rendered):
            return None
        processes = process_count(self.scenario.cameras.render_processes)
        latency = min(vision.lag_cycles - 1, MOST_LATENCY)
        if processes == 0 or latency <= 0:
            return None
        return ImagePipeline(latency, processes, lambda cycle: cycle % vision.update_cycles == 0)


def resolve(scenario: BaseScenario) -> ConveyorSetup:
    """Returns the resolved scenario of the conveyor.

    Args:
        scenario: the settings.

    Raises DrakeTrackerError when the scenario belongs to another task.
    """
    if not isinstance(scenario, ConveyorScenario):
        raise DrakeTrackerError(f"{scenario.where('task')} = {scenario.task}: this needs a scenario of the conveyor")
    return ConveyorSetup(scenario)
