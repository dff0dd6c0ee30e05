"""Where the markers on the fingers of a hand are, by the measured joints."""

from typing import NamedTuple

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from drake_tracker.arm.description import MARKERS, ArmDescription
from drake_tracker.arm.plant import add_arm
from drake_tracker.core.errors import DrakeTrackerError


class MarkerPlaces(NamedTuple):
    """The markers of a hand at one instant.

    Attributes:
        p_WM: centres of the markers in the order of `MARKERS`, shape (2, 3) [m].
        up_W: unit vectors along the axes of the drums, away from the fingertips, shape (2, 3).
        p_WT: the tool point between the pads, shape (3,) [m].
    """

    p_WM: np.ndarray
    up_W: np.ndarray
    p_WT: np.ndarray


class MarkerKinematics:
    """Kinematics of the markers of an arm's hand.

    One scratch Context serves all calls, and no state is kept between calls.

    Args:
        description: the arm and its hand.

    Raises DrakeTrackerError when the model of the hand has no markers.
    """

    def __init__(self, description: ArmDescription) -> None:
        self._plant = MultibodyPlant(0.0)
        parts = add_arm(self._plant, description=description)
        self._plant.Finalize()
        if not all(self._plant.HasBodyNamed(name, parts.gripper) for name in MARKERS):
            raise DrakeTrackerError(f"{description.gripper_url} must have the links {' and '.join(MARKERS)}")
        self._arm = parts.arm
        self._tool = self._plant.GetFrameByName(description.tool_frame, parts.gripper)
        self._markers = [self._plant.GetFrameByName(name, parts.gripper) for name in MARKERS]
        self._fingers = [self._plant.GetJointByName(name, parts.gripper) for name in description.fingers]
        self._scratch = self._plant.CreateDefaultContext()

    def places(self, q: np.ndarray, jaw_width: float) -> MarkerPlaces:
        """Returns where the markers are.

        Args:
            q: joint positions of the arm, shape (n,) [rad].
            jaw_width: opening of the jaws [m], half of which is the position of each finger.
        """
        self._plant.SetPositions(self._scratch, self._arm, q)
        for finger in self._fingers:
            finger.set_translation(self._scratch, 0.5 * jaw_width)
        world = self._plant.world_frame()
        X_WM = [self._plant.CalcRelativeTransform(self._scratch, world, frame) for frame in self._markers]
        p_WT = self._plant.CalcRelativeTransform(self._scratch, world, self._tool).translation()
        return MarkerPlaces(
            np.array([X.translation() for X in X_WM]), np.array([-X.rotation().matrix()[:, 2] for X in X_WM]), p_WT
        )
