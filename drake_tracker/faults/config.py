"""Settings of the faults. The name of a class is its YAML tag."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.constants import SIDES
from drake_tracker.core.setting import setting

CAMERAS = ("left", "right", "both")
IMAGES = (*CAMERAS, "wrist")
TRAIN, BOTH_TASKS, ALL_TASKS = ("train",), ("train", "ball"), ("train", "ball", "conveyor")
TRAIN_AND_CONVEYOR, CONVEYOR = ("train", "conveyor"), ("conveyor",)


@dataclass(frozen=True)
class FaultConfig:
    """When a fault acts.

    Attributes:
        tasks: tasks in which it can happen.
    """

    tasks: ClassVar[tuple[str, ...]] = TRAIN
    at: float = setting(0.0, "time at which it begins", "s", (0.0, 36000.0))
    duration: float | None = setting(
        None, "how long it lasts; null: to the end of the run", "s", (0.001, 36000.0), key="for"
    )


@dataclass(frozen=True)
class ImageFaultConfig(FaultConfig):
    """When a fault acts, and on which camera. The ball has one camera, so that ``camera`` must be both."""

    tasks: ClassVar[tuple[str, ...]] = ALL_TASKS
    camera: str = setting("both", "which camera; both are the fixed ones", choices=IMAGES)


@dataclass(frozen=True)
class CameraDark(ImageFaultConfig):
    """The images are black."""


@dataclass(frozen=True)
class FrozenImage(ImageFaultConfig):
    """The camera repeats the image that it took when the fault began."""


@dataclass(frozen=True)
class Flicker(ImageFaultConfig):
    """The brightness of the images changes as a sinusoid."""

    amplitude: float = setting(0.3, "amplitude as a fraction of the mean brightness", "", (0.0, 1.0))
    frequency: float = setting(100.0, "frequency of the light", "Hz", (0.0, 1000.0))


@dataclass(frozen=True)
class ImageNoise(ImageFaultConfig):
    """The images have more sensor noise."""

    std: float = setting(30.0, "standard deviation of the additional noise", "grey levels", (0.0, 128.0))


@dataclass(frozen=True)
class CameraKnocked(ImageFaultConfig):
    """A camera is turned about its centre, as by a knock, while its calibration stays."""

    angle_deg: float = setting(1.0, "angle by which it is turned", "deg", (-30.0, 30.0))
    direction_deg: float = setting(
        0.0, "direction in the image in which it then looks: 0 right, 90 down", "deg", (-360.0, 360.0)
    )


@dataclass(frozen=True)
class CameraShake(ImageFaultConfig):
    """A camera trembles about its direction, as on a loose mount, while its calibration stays."""

    std: float = setting(1.0, "standard deviation of the displacement in u and in v", "px", (0.0, 20.0))
    correlation_time: float = setting(
        0.0, "time in which a displacement turns into another, independent one; 0: new in every image", "s", (0.0, 10.0)
    )


@dataclass(frozen=True)
class CameraPan(ImageFaultConfig):
    """A camera turns at a constant rate, and stays where it looks when the fault ends. Its calibration stays."""

    rate: float = setting(0.5, "displacement from image to image", "px", (0.0, 20.0))
    direction_deg: float = setting(
        0.0, "direction in the image in which it turns: 0 right, 90 down", "deg", (-360.0, 360.0)
    )


@dataclass(frozen=True)
class CastShadow(FaultConfig):
    """A soft band of shadow moves over the table again and again."""

    darkness: float = setting(0.5, "fraction of the light that is missing in its middle", "", (0.0, 1.0))
    width: float = setting(0.12, "width of the band", "m", (0.01, 1.0))
    speed: float = setting(0.25, "speed of the band", "m/s", (0.01, 5.0))
    heading_deg: ClassVar[float] = 0.0
    """Direction of its motion in the world, from x towards y [deg]; chosen."""


@dataclass(frozen=True)
class PassingOccluder(FaultConfig):
    """A panel moves in front of one camera and back."""

    camera: str = setting("left", "which camera", choices=SIDES)
    width: float = setting(0.40, "width of the panel", "m", (0.02, 0.6))
    height: float = setting(0.50, "height of the panel", "m", (0.02, 0.6))


@dataclass(frozen=True)
class SecondMover(FaultConfig):
    """A box of the size of the train stands on the table, and moves to and fro while the fault lasts."""

    place: tuple[float, ...] = setting([0.56, 0.0], "where it stands in the world", "m", (-2.0, 2.0), shape=(2,))
    amplitude: float = setting(0.07, "distance by which it moves to either side, along y", "m", (0.005, 0.3))
    speed: float = setting(0.15, "its largest speed", "m/s", (0.01, 1.0))


@dataclass(frozen=True)
class CalibrationWrong:
    """The controller's model of a camera is wrong during the whole run.

    The model is rotated about the vertical axis through the camera and moved sideways.
    """

    tasks: ClassVar[tuple[str, ...]] = TRAIN
    camera: str = setting("right", "which camera", choices=CAMERAS)
    angle_deg: float = setting(1.0, "angle by which its model is rotated", "deg", (-30.0, 30.0))
    distance: float = setting(0.0, "distance by which its model is moved to its right", "m", (-0.5, 0.5))


@dataclass(frozen=True)
class LinkLoss(FaultConfig):
    """Packets are lost, each independently."""

    tasks: ClassVar[tuple[str, ...]] = ALL_TASKS
    drop: float = setting(1.0, "fraction of packets lost", "", (0.0, 1.0))


@dataclass(frozen=True)
class LinkBursts(FaultConfig):
    """Packets are lost in bursts."""

    tasks: ClassVar[tuple[str, ...]] = ALL_TASKS
    drop: float = setting(0.7, "long-run fraction of packets lost", "", (0.0, 1.0))
    burst: float = setting(60.0, "mean number of packets lost in a row", "packets", (1.0, 1000.0))


@dataclass(frozen=True)
class LinkJitter(FaultConfig):
    """Packets arrive late by a random time."""

    tasks: ClassVar[tuple[str, ...]] = ALL_TASKS
    jitter: float = setting(0.5, "largest delay, drawn uniformly from 0 for each packet", "s", (0.0, 5.0))


@dataclass(frozen=True)
class LinkDelay(FaultConfig):
    """Packets arrive late."""

    tasks: ClassVar[tuple[str, ...]] = ALL_TASKS
    delay: float = setting(1.0, "delay of every packet", "s", (0.0, 5.0))


@dataclass(frozen=True)
class HostStopped(FaultConfig):
    """The host stops, and starts again with an empty memory."""

    tasks: ClassVar[tuple[str, ...]] = BOTH_TASKS


@dataclass(frozen=True)
class TrainStopped(FaultConfig):
    """The train stops on its track."""


@dataclass(frozen=True)
class TrainReversed(FaultConfig):
    """The train runs backwards."""


@dataclass(frozen=True)
class TrainPushed(FaultConfig):
    """A force pushes the train."""

    duration: float | None = setting(0.2, "how long it lasts", "s", (0.001, 36000.0), key="for")
    force: float = setting(2.0, "the force; negative: backwards or to the right", "N", (-50.0, 50.0))
    direction: str = setting("along", "along the train, or across it to its left", choices=("along", "across"))


@dataclass(frozen=True)
class TrainDerailed(FaultConfig):
    """An invisible hand, stronger than the rail, pushes the train off its track and leaves it beside it."""

    duration: float | None = setting(1.0, "how long it lasts", "s", (0.2, 10.0), key="for")
    force: float = setting(12.0, "largest force", "N", (8.0, 50.0))
    speed: float = setting(0.25, "sideways speed to which it pushes the train", "m/s", (0.05, 2.0))
    side: str = setting("left", "side of the train to which it is pushed", choices=("left", "right"))


@dataclass(frozen=True)
class TrainMoved(FaultConfig):
    """An invisible hand carries the train to another place on the table and puts it down there."""

    duration: float | None = setting(3.0, "time within which the hand carries it", "s", (1.0, 60.0), key="for")
    to: tuple[float, ...] = setting(
        [0.56, 0.0], "where the train is put down, in the world", "m", (-2.0, 2.0), shape=(2,)
    )


@dataclass(frozen=True)
class TrainRemoved(FaultConfig):
    """An invisible hand carries the train out of the work volume."""

    duration: float | None = setting(3.0, "time within which the hand carries it", "s", (1.0, 60.0), key="for")
    to: tuple[float, ...] = setting(
        [0.56, 0.43], "where the train is put down, in the world", "m", (-2.0, 2.0), shape=(2,)
    )


@dataclass(frozen=True)
class StickingJoint(FaultConfig):
    """A joint of the arm has additional dry friction."""

    tasks: ClassVar[tuple[str, ...]] = TRAIN_AND_CONVEYOR
    joint: int = setting(1, "number of the joint, from 1", "", (1, 20))
    friction: float = setting(20.0, "friction torque", "N m", (0.0, 200.0))


@dataclass(frozen=True)
class SlowGripper(FaultConfig):
    """The gripper closes and opens more slowly than it is told."""

    tasks: ClassVar[tuple[str, ...]] = TRAIN_AND_CONVEYOR
    speed: float = setting(0.04, "largest rate at which the opening changes", "m/s", (0.001, 0.4))


@dataclass(frozen=True)
class WeakGripper(FaultConfig):
    """The drive of the gripper has less force."""

    tasks: ClassVar[tuple[str, ...]] = TRAIN_AND_CONVEYOR
    force: float = setting(0.5, "largest force on each pad", "N", (0.0, 25.0))


@dataclass(frozen=True)
class HandOverBelt(FaultConfig):
    """A hand reaches over the belt from the side of the cameras, stays there, and is withdrawn."""

    tasks: ClassVar[tuple[str, ...]] = CONVEYOR
    y: float = setting(-0.15, "where it reaches over the belt, along the belt", "m", (-1.0, 1.0))
    reach: float = setting(0.02, "how far it reaches beyond the middle of the belt", "m", (-0.1, 0.1))
    height: float = setting(0.06, "height of its lower side above the belt", "m", (0.04, 0.3))


@dataclass(frozen=True)
class EncoderJump(FaultConfig):
    """The encoder reads a wrong distance, as after lost counts."""

    tasks: ClassVar[tuple[str, ...]] = CONVEYOR
    distance: float = setting(0.3, "offset added to its distance", "m", (-10.0, 10.0))


@dataclass(frozen=True)
class EncoderStopped(FaultConfig):
    """The encoder stands still, as when its wheel has lost the belt."""

    tasks: ClassVar[tuple[str, ...]] = CONVEYOR
