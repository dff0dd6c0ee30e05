"""A resolved run of the ball: everything that follows from a scenario and the poses of the board, each value computed
once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drake_tracker.arm.arm_model import ArmModel, make_arm_model, tool_down
from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.cameras.boards.board_poses import BoardPoses
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.faults.fault import Fault
from drake_tracker.faults.kinds import make_faults
from drake_tracker.grasp.ball.board_exit import BoardEdge
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.filming import HAND_BORDER
from drake_tracker.vision.centroid.plane_projection import (
    PlausiblePoints,
    board_window,
    camera_on_board,
    seen_whole_from,
)
from drake_tracker.vision.region_of_interest import RegionOfInterest
from drake_tracker.world.ball.ball_board import BALL_RADIUS
from drake_tracker.world.imaging.cameras import ImageWindow, lens_matrix, renderable_window


@dataclass(frozen=True, eq=False)
class BallSetup:
    """A resolved scenario of the ball. Everything but the arguments is computed when it is first read.

    Attributes:
        scenario: the settings.
        poses: poses of the board, as the initialisation found them.
    """

    scenario: BallScenario
    poses: BoardPoses

    @cached_property
    def arm(self) -> ArmDescription:
        """The arm and its cup. Raises DrakeTrackerError when a custom arm cannot be used."""
        return arm_of(self.scenario)

    @cached_property
    def model(self) -> ArmModel:
        """The controller's model of the arm."""
        return make_arm_model(self.arm)

    @cached_property
    def edge(self) -> BoardEdge:
        """The bottom edge of the board, as the arm knows it."""
        X_WB, board = self.poses.X_WB.GetAsMatrix4(), self.scenario.board
        return BoardEdge(X_WB, width=board.width, ball_radius=BALL_RADIUS, beyond=self.scenario.catch.beyond)

    @cached_property
    def q_initial(self) -> np.ndarray:
        """Joints at the start, with the cup at the middle of the edge [rad], shape (n,)."""
        waiting = self.edge.home + [0.0, 0.0, self.scenario.catch.rim_height, 0.0]
        return joints_for(self.model, self.arm.q_start, tool_down(waiting[:3], waiting[3]))

    @cached_property
    def faults(self) -> tuple[Fault, ...]:
        """The injected faults."""
        scenario = self.scenario
        return make_faults(scenario.faults, seed=scenario.seed, lag=scenario.vision.throughput_cycles * VISION_PERIOD)

    @cached_property
    def camera(self) -> CameraModel:
        """The camera in the frame of the board, as the initialisation found it."""
        config = self.scenario.camera
        return camera_on_board(lens_matrix(config), self.poses.X_CB.GetAsMatrix4(), config.width, config.height)

    @cached_property
    def search_window(self) -> RegionOfInterest:
        """The window of interest: the board in the image."""
        board = self.scenario.board
        return board_window(self.camera, board.width, board.length, 2.0 * BALL_RADIUS, self.scenario.vision.bottom)

    @cached_property
    def window(self) -> ImageWindow:
        """The part of the image that is rendered: the board with its surroundings, as the video shows it."""
        config = self.scenario.camera
        if not config.render_window:
            return (0, 0, config.width, config.height)
        u0, v0, width, height = self.search_window.bounds
        around = (u0 - HAND_BORDER, v0 - HAND_BORDER, width + 2 * HAND_BORDER, height + 2 * HAND_BORDER)
        return renderable_window(around, config.width, config.height)

    @cached_property
    def plausible_points(self) -> PlausiblePoints:
        """Which points on the board vision accepts."""
        board, settings = self.scenario.board, self.scenario.vision
        incline = np.arccos(self.poses.X_WB.rotation().matrix()[2, 2])
        seen_from = seen_whole_from(self.camera, settings.bottom, BALL_RADIUS)
        return PlausiblePoints(board.width, board.length, incline, seen_from, settings.tolerance)


def resolve(scenario: BaseScenario, poses: BoardPoses) -> BallSetup:
    """Returns the resolved scenario of the ball.

    Args:
        scenario: the settings.
        poses: poses of the board, as `initialise_board` finds them.

    Raises DrakeTrackerError when the scenario belongs to another task.
    """
    if not isinstance(scenario, BallScenario):
        raise DrakeTrackerError(f"{scenario.where('task')} = {scenario.task}: this needs a scenario of the ball")
    return BallSetup(scenario, poses)
