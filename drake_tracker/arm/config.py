"""Settings of the arms and of the trajectory generator. The name of an arm's class is its YAML tag."""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class ServoConfig:
    """The fixed-gain filter of the trajectory generator.

    Attributes:
        tracking_index: tracking index of the position, the ratio of manoeuvre noise to measurement noise. At 0.01 the
            filter lags by 1 mm in a bend at 0.2 m/s.
        yaw_tracking_index: tracking index of the direction, which is noisier and changes more steadily.
        descent_tracking_index: the tracking index of the position during a guided descent, which must follow a change
            of speed at once.
        descent_yaw_tracking_index: the same for the direction. Where a bend of 0.12 m radius becomes a straight at
            0.15 m/s, a filter with index 0.003 overshoots by 4 deg, with 0.05 by 1.3 deg.
        stale_after: time [s] without a new packet after which the target counts as stale.
    """

    tracking_index: float = setting(0.01, "ratio of manoeuvre noise to measurement noise, position", "", (0.001, 10.0))
    yaw_tracking_index: float = setting(
        0.003, "ratio of manoeuvre noise to measurement noise, direction", "", (0.0001, 10.0)
    )
    descent_tracking_index: ClassVar[float] = 0.15
    """The same as tracking_index, during a guided descent; chosen."""
    descent_yaw_tracking_index: ClassVar[float] = 0.05
    """The same as yaw_tracking_index, during a guided descent; chosen."""
    stale_after: ClassVar[float] = 0.2
    """Age of the newest packet from which the target is stale [s]; chosen."""


@dataclass(frozen=True)
class PacketGuardConfig:
    """Limits of the packets that the receiver accepts. `drake_tracker.arm.safety.packet_guard.PacketGuard` explains the
    limits.

    Attributes:
        margin: distance from the volume in which vision sees the object up to which a path may begin [m]. Vision
            accepts points up to 0.05 m outside of the volume; the rest of the margin allows for the overshoot of a
            filter.
        max_speed: largest speed at which a path may begin [m/s]. The fastest train has a mean speed of 1 m/s that
            varies by 90 %; the ball rolls more slowly.
        table_tolerance: largest depth of a path below the table top [m]. It is less than the height at which the hand
            hovers over the path (0.22 m), so that a hand that follows a path stays above the table.
        clock_tolerance: time by which a stamp may be later than the arm's clock [s]. LCM messages have times in whole
            milliseconds.
    """

    margin: float = setting(0.10, "distance outside the volume of vision up to which a path may begin", "m", (0.0, 5.0))
    max_speed: ClassVar[float] = 2.0
    """Largest speed at which a predicted path may begin [m/s]; derived: the fastest train reaches 1.9 m/s."""
    table_tolerance: ClassVar[float] = 0.20
    """Largest depth of a predicted path below the table top [m]; derived: less than `GraspConfig.hover_height`."""
    clock_tolerance: ClassVar[float] = 0.001
    """Time by which a stamp may be later than the arm's clock [s]; derived: LCM's times are in milliseconds."""


@dataclass(frozen=True)
class HandEyeConfig:
    """How the cameras' view of the hand corrects where the hand is sent. Needs markers on the hand (``arm.markers``).

    Attributes:
        correct: whether the target is corrected. Without it, the cameras' measurements of the hand are logged, and
            displace the mask of the arm in the images.
        time_constant: time constant with which the correction follows the measurements [s].
        largest_rate: largest rate at which it follows them [m/s].
        largest: largest distance between the hand that is seen and the hand that the joints tell [m]. A measurement
            beyond it is not used, so that a mistake of vision cannot send the hand farther astray.
        outlier: distance from the measurements before it from which a measurement counts as an outlier [m].
        keep: time after the last measurement for which the correction is kept [s]. Then it fades away. The mask of the
            arm in the images is displaced for as long.
        reach: largest displacement of a marker from its predicted place at which it is searched for [m].
    """

    correct: bool = setting(True, "whether the cameras' measurements of the hand correct its target")
    time_constant: ClassVar[float] = 0.06
    """Time in which the correction follows the measurements [s]; chosen."""
    largest_rate: ClassVar[float] = 0.1
    """Largest rate at which the correction changes [m/s]; chosen."""
    largest: float = setting(
        0.05, "largest distance between the hand seen and the hand measured by its joints", "m", (0.0, 0.2)
    )
    outlier: ClassVar[float] = 0.015
    """Distance from earlier measurements from which one counts as an outlier [m]; chosen."""
    keep: ClassVar[float] = 3.0
    """Time after the last measurement for which the correction is kept [s]; chosen."""
    reach: float = setting(
        0.04, "distance from its predicted place up to which a marker is searched for", "m", (0.005, 0.1)
    )


@dataclass(frozen=True)
class Puma560:
    """The PUMA 560, the arm of the 1991 laboratory. It has a gripper or a cup.

    Attributes:
        markers: whether the fingers of the gripper carry markers by which cameras see where the hand is. The arm then
            corrects its target by the measured markers (`HandEyeConfig`).
    """

    markers: bool = setting(False, "markers on the fingers, by which the cameras see the hand; for the train only")


@dataclass(frozen=True)
class SevenJoint:
    """An arm with seven joints, with the kinematics of the Robotics Research K-1607. It has a cup."""


@dataclass(frozen=True)
class UR5e:
    """A modern arm with six joints: kinematics, masses and limits of the Universal Robots UR5e. It has a
    gripper."""


class HandKind(Enum):
    """The hand at the end of an arm; a task needs a given kind of hand."""

    GRIPPER = "gripper"
    CUP = "cup"
