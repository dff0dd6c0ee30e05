"""The base class of the faults, and one class for each place where a fault can act.

A fault derives from the classes of its places. The diagrams ask for the faults of a place with `faults_at` and insert a
System, or wrap a part, only where there are any. A fault has no memory: its effect follows from the time and from its
arguments.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.messages import Prediction
from drake_tracker.estimation.estimator import Estimator
from drake_tracker.link.link import Link

TIME_TOLERANCE = 1e-9
"""Tolerance of times that are sums of periods [s]."""
FAULT_STREAM = 70
"""The faults' stream of random numbers: default_rng([seed, FAULT_STREAM, number of the fault, ...])."""
Place = TypeVar("Place")


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        settings: one of the dataclasses in `drake_tracker.faults.config`.
        seed: of its random numbers.
        number: its place in the list of faults.
    """

    settings: Any
    seed: int = 0
    number: int = 0

    @property
    def begin(self) -> float:
        """When it begins [s]."""
        return getattr(self.settings, "at", 0.0)

    @property
    def end(self) -> float:
        """When it ends [s]; infinity when it lasts to the end of the run."""
        duration = getattr(self.settings, "duration", None)
        return math.inf if duration is None else self.begin + duration

    def active(self, time: float) -> bool:
        """Returns whether it acts at a time [s]: from its beginning on, and no longer at its end."""
        return self.begin - TIME_TOLERANCE <= time < self.end - TIME_TOLERANCE

    def random(self, *counters: int) -> np.random.Generator:
        """Returns the generator of the random numbers that belong to these counters."""
        return np.random.default_rng([self.seed, FAULT_STREAM, self.number, *counters])

    def hits(self, camera: str) -> bool:
        """Returns whether it concerns a camera: "left", "right", "wrist", or "both" for the only one of a task."""
        return self.settings.camera == camera or (self.settings.camera == "both" and camera != "wrist")


@dataclass(frozen=True)
class FaultyView:
    """A camera whose images are changed.

    Attributes:
        camera: "left", "right", or "both" for the only camera of a task.
        model: the true camera, of the full image.
        window: part of the full image that its images show: (u0, v0, width, height) [px].
    """

    camera: str
    model: CameraModel
    window: tuple[int, int, int, int]


@dataclass(frozen=True)
class Sight:
    """One camera's view of the object in one cycle, with measured vision.

    Attributes:
        camera: "left" or "right".
        model: the calibrated camera.
        time: of the image [s].
        cycle: number of the cycle.
        p_WQ: the measured point, shape (3,) [m]; None where nothing was seen.
        uv: its centroid in the image, shape (2,) [px]; None where the camera sees nothing.
    """

    camera: str
    model: CameraModel
    time: float
    cycle: int
    p_WQ: np.ndarray | None
    uv: np.ndarray | None


@dataclass(frozen=True)
class MovingBody:
    """A box on a slide, driven to a place at any time.

    Attributes:
        name: of the body.
        size: along the axes of its frame [m].
        colour: red, green, blue, opacity, from 0 to 1.
        X_WP: (4, 4) pose of its frame at the zero of the slide.
        axis: of the slide, in its frame.
        travel: largest distance from the zero to either side [m].
        mass: [kg].
        bandwidth: of the drive [rad/s].
        force: largest force of the drive [N].
        solid: whether it collides with other bodies.
    """

    name: str
    size: tuple[float, float, float]
    colour: tuple[float, float, float, float]
    X_WP: np.ndarray
    axis: tuple[float, float, float]
    travel: float
    mass: float = 0.5
    bandwidth: float = 30.0
    force: float = 200.0
    solid: bool = False


class ImageFault(Fault):
    """A fault that changes the images of cameras."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        """Returns the changed image, of the same shape and type; the given one is not changed.

        Only called while the fault is active.

        Args:
            image: RGBA, shape (h, w, 4), uint8.
            view: the camera.
            time: of the image [s].
            held: the image at the beginning of the fault, None until there is one.
        """
        raise NotImplementedError


class PointFault(Fault):
    """A fault that changes where a camera sees the object, with measured vision."""

    def centroid(self, sight: Sight) -> np.ndarray | None:
        """Returns the centroid (2,) [px] that the camera finds, or None when it finds none.

        Only called while the fault is active.
        """
        raise NotImplementedError


class CalibrationFault(Fault):
    """A fault of the camera models that the controller uses."""

    def calibrated(self, camera: str, model: CameraModel) -> CameraModel:
        """Returns the model that the controller has of a camera, "left" or "right", in place of the calibrated one."""
        raise NotImplementedError


class LinkFault(Fault):
    """A fault of the link between host and arm."""

    def link(self, link: Link[Any], message: Any = Prediction) -> Link[Any]:
        """Returns the link with the fault."""
        raise NotImplementedError


class HostFault(Fault):
    """A fault of the host."""

    def estimator(self, estimator: Estimator[Any]) -> Estimator[Any]:
        """Returns the estimator with the fault."""
        raise NotImplementedError


class SpeedFault(Fault):
    """A fault of the drive of the train."""

    def target_speed(self, speed: float) -> float:
        """Returns the speed to which the train is driven [m/s]. Only called while the fault is active."""
        raise NotImplementedError


class TrainFault(Fault):
    """A fault that applies a force to the train."""

    def wrench(self, time: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns torque (3,) [N m] and force (3,) [N] at the train's reference point, in W.

        Only called while the fault is active.

        Args:
            time: [s].
            state: the 13 numbers of the free body.
        """
        raise NotImplementedError


class SceneFault(Fault):
    """A fault that adds a moving body to the laboratory."""

    @property
    def body(self) -> MovingBody:
        """The body."""
        raise NotImplementedError

    def slide(self, time: float) -> tuple[float, float]:
        """Returns the set-point of the body's slide at a time: position [m] and speed [m/s]."""
        raise NotImplementedError


class JointFault(Fault):
    """A fault of a joint of the arm."""

    def torques(self, v: np.ndarray) -> np.ndarray:
        """Returns additional torques (n,) [N m] at joint velocities (n,) [rad/s]. Only called while it is active."""
        raise NotImplementedError


class GripperFault(Fault):
    """A fault of the gripper's drive."""

    def set_point(self, desired: np.ndarray, before: float, position: float, time_step: float) -> np.ndarray:
        """Returns the set-point that the drive follows, position [m] and speed [m/s] of the driven finger.

        Only called while the fault is active.

        Args:
            desired: the set-point that the drive was given, shape (2,).
            before: position of the set-point returned one step ago [m].
            position: of the finger [m].
            time_step: length of a step [s].
        """
        raise NotImplementedError


class EncoderFault(Fault):
    """A fault of the encoder of a belt."""

    def travelled(self, time: float, distance: Callable[[float], float]) -> float:
        """Returns the distance that the encoder reads [m]. Only called while the fault is active.

        Args:
            time: [s].
            distance: that the belt has travelled [m], as a function of time [s].
        """
        raise NotImplementedError


def faults_at(faults: Iterable[Fault], place: type[Place]) -> list[Place]:
    """Returns the faults that act at a place, in their order.

    Args:
        faults: all faults of a run.
        place: one of the classes of this module, such as `ImageFault`.
    """
    return [fault for fault in faults if isinstance(fault, place)]


def calibrated_with(faults: Iterable[Fault], cameras: Mapping[str, CameraModel]) -> dict[str, CameraModel]:
    """Returns {side: model that the controller has of the camera}.

    Args:
        faults: all faults of a run.
        cameras: {side: calibrated camera}.
    """
    models = dict(cameras)
    for fault in faults_at(faults, CalibrationFault):
        models = {side: fault.calibrated(side, model) for side, model in models.items()}
    return models
