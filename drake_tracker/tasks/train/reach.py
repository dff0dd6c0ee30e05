"""The reach of an arm: the pose in which it waits, and whether it can follow a track."""

import numpy as np

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.motion.differential_ik import joints_for, make_parameters, step_joints
from drake_tracker.arm.motion.transform_equation import LEVEL, surface_normal
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.world.train.tracks import Track

CHECKED_PLACES = 40
"""Number of places along a track that are checked."""
_STEP, _STEPS = 0.1, 20
"""Time step of the inverse kinematics from one place to the next [s], and greatest number of steps."""
_NEAR = 1e-3
"""Distance from a place at which the tool has reached it [m]."""


class Reach:
    """An arm and its reach over the table.

    Args:
        description: the arm and its hand.
        home: reference (x, y, z, yaw) in W over which the hand waits, at the height of the train [m, rad], shape (4,).
        grasp: settings of the grasp.

    Attributes:
        description: as given.
        model: the controller's model of the arm.
        home: as given.
        q_initial: joints over ``home``, with the tool pointing down at the hover height [rad], shape (n,).

    Raises DrakeTrackerError when the arm cannot reach this pose.
    """

    def __init__(self, description: ArmDescription, home: np.ndarray, grasp: GraspConfig) -> None:
        self._heights = ((grasp.hover_height, False), (grasp.grasp_height, grasp.follow_tilt))
        self.description, self.home = description, home
        self.model = make_arm_model(description)
        self._parameters = make_parameters(self.model, _STEP)
        over_home = tool_down(home[:3] + [0.0, 0.0, grasp.hover_height], home[3])
        self.q_initial = joints_for(self.model, description.q_start, over_home)
        self._checked: tuple[Track, tuple[float, float, float] | None] | None = None

    def missed(self, track: Track) -> tuple[float, float, float] | None:
        """Returns the first place of a track that the tool cannot reach, for hovering or for grasping.

        Args:
            track: the track.

        Returns (x and y in W, height above the train) [m], or None when the tool can reach all places.
        """
        if self._checked is None or self._checked[0] is not track:
            self._checked = track, self._first_missed(track)
        return self._checked[1]

    def _first_missed(self, track: Track) -> tuple[float, float, float] | None:
        q = np.array(self.q_initial)
        for s in np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False):
            x, y = (float(value) for value in track.pose(s)[:2])
            q, height = self._move(q, track, float(s))
            if height is not None:
                return x, y, height
        return None

    def reached(self, track: Track, s: np.ndarray) -> np.ndarray:
        """Returns which places of a track the tool can reach, for hovering and for grasping, bool of shape (n,).

        The tool goes from the place nearest to ``home`` along the track in both directions. Where it comes to a place
        that it cannot reach, the places behind it count as out of reach.

        Args:
            track: the track.
            s: arc lengths of the places, ascending, shape (n,) [m].
        """
        x, y, _ = track.pose(s)
        nearest = int(np.argmin(np.hypot(x - self.home[0], y - self.home[1])))
        found = np.zeros(len(s), dtype=bool)
        for places in (range(nearest, len(s)), range(nearest, -1, -1)):
            q = np.array(self.q_initial)
            for k in places:
                q, height = self._move(q, track, float(s[k]))
                if height is not None:
                    break
                found[k] = True
        return found

    def _move(self, q: np.ndarray, track: Track, s: float) -> tuple[np.ndarray, float | None]:
        """Moves the tool over the place of a track at arc length s [m]. Returns the joints [rad] and the height above
        the train [m] at which the place cannot be reached, None when it can."""
        x, y, heading = (float(value) for value in track.pose(s))
        z, rise, _ = (float(value) for value in track.profile(s))
        for height, tilts in self._heights:
            slope = rise * np.array([np.cos(heading), np.sin(heading)]) if tilts else LEVEL
            p_WT = (x, y, self.home[2] + z) + height * surface_normal(slope)
            for yaw in (np.pi / 2, -np.pi / 2) if self.model.symmetric_hand else (np.pi / 2,):
                X_WT = tool_down(p_WT, yaw, slope)
                q_near = q
                for _ in range(_STEPS):
                    q_near, _ = step_joints(self.model, self._parameters, q_near, X_WT)
                    if np.linalg.norm(self.model.tool_pose(q_near).translation() - X_WT.translation()) < _NEAR:
                        break
                else:
                    continue
                q = q_near
                break
            else:
                return q, height
        return q, None
