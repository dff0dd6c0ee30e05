"""Settings of the motor schemas, which are also the parameters of their machines."""

from dataclasses import dataclass, field
from typing import ClassVar

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class GraspConfig:
    """The motor schema of grasping: the known width of the object, heights, durations, and conditions of the gate.

    Heights are heights of the tool above the object's reference point, at which its motion is seen. This point lies a
    few millimetres below the centre of the body, since the wheels move too: jaws that close slightly above it close on
    the middle of the body. Each setting is described by its ``help``.

    Attributes:
        turns: whether the object turns with its path; otherwise the jaws keep their direction.
        reach: largest error along the jaws at which they still hold the object [m]: half of its length. Both follow
            from the object, and are no settings.
    """

    object_width: float = setting(
        0.040, "width of the object between the jaws; 0.04: that of train.body", "m", (0.005, 0.085)
    )
    turns: bool = field(default=True, kw_only=True, repr=False)
    reach: float = field(default=0.060, kw_only=True, repr=False)
    jaw_opening: float = setting(0.088, "opening of the jaws before the grasp", "m", (0.010, 0.090))
    jaw_speed: ClassVar[float] = 0.40
    """Rate at which the opening changes [m/s]; chosen."""
    grip_force: ClassVar[float] = 25.0
    """Force of the gripper on each pad [N]; chosen."""
    hover_height: float = setting(0.22, "height while tracking", "m", (0.10, 0.40))
    grasp_height: ClassVar[float] = 0.004
    """Height at which the jaws close [m]; chosen."""
    lift_height: float = setting(0.15, "height after the lift", "m", (0.02, 0.40))
    approach_duration: float = setting(1.0, "duration of the motion to a place above the object", "s", (0.2, 10.0))
    descent_duration: float = setting(0.36, "duration of the descent", "s", (0.2, 5.0))
    descent: str = setting(
        "blind",
        "guided: new packets until the jaws hold; blind: as in 1991, no new packets from the launch on",
        choices=("guided", "blind"),
    )
    closing_lead: float = setting(
        0.06, "time before the end of the descent at which the jaws begin to close", "s", (0.0, 0.3)
    )
    close_timeout: ClassVar[float] = 0.5
    """Time after which jaws without a grip have missed [s]; chosen."""
    lift_duration: ClassVar[float] = 1.0
    """Duration of the lift [s]; chosen."""
    retreat_duration: ClassVar[float] = 1.0
    """Duration of the retreat after a miss, and of the motion home [s]; chosen."""
    settle_time: float = setting(0.5, "time above the object before an intercept", "s", (0.0, 60.0))
    follow_tilt: bool = setting(False, "whether the hand tilts to the slope of the path in a descent")
    stop_duration: ClassVar[float] = 0.25
    """Time in which the operator's stop brings the hand to rest [s]; chosen."""
    manual_speed: ClassVar[float] = 0.15
    """Largest speed of the hand under the operator's control [m/s]; chosen."""
    when_stale: str = setting(
        "coast",
        "behaviour without packets: follow the predicted path, or stand still",
        choices=("coast", "hold"),
    )
    silence: ClassVar[float] = 1.0
    """Time without a new packet after which the hand stands still, high above the object [s]; chosen."""
    gate: str = setting(
        "auto",
        "evidence that a prediction needs; probability: launch_probability; auto: memory or recent",
        choices=("probability", "auto", "memory", "recent"),
    )
    launch_probability: float = setting(
        0.912,
        "with gate probability: least probability of success, lowered by surprises; from 0.68 if it will not rise",
        "",
        (0.0, 1.0),
    )
    abort_probability: ClassVar[float] = 0.437
    """In a guided descent: probability of success, lowered by surprises, below which the hand goes up again; chosen."""
    memory_radius: ClassVar[float] = 0.03
    """Distance below which an earlier place counts as the same [m]; chosen."""
    lateral_tolerance: ClassVar[float] = 0.012
    """Largest prediction error across the path [m]; chosen."""
    along_tolerance: ClassVar[float] = 0.030
    """Largest prediction error along the path [m]; chosen."""
    std_tolerance: ClassVar[float] = 0.005
    """Predicted standard deviation at the grasp below which the filter is trusted [m]; chosen."""
    turn_tolerance_deg: float = setting(15.0, "largest prediction error in direction", "deg", (0.0, 90.0))
    straight_length: ClassVar[float] = 0.25
    """Length of a straight path from which the track counts as open [m]; chosen."""
    straight_tolerance: ClassVar[float] = 0.008
    """Distance from a line up to which a path counts as straight [m]; chosen."""


@dataclass(frozen=True)
class PickConfig:
    """The motor schema of picking parts from a belt and placing them.

    Heights are heights of the tool above the origin of the part, or of its cell: half the height of the part above its
    support. Each setting is described by its ``help``.
    """

    jaw_opening: float = setting(0.088, "opening of the jaws before the pick", "m", (0.010, 0.090))
    jaw_speed: ClassVar[float] = 0.40
    """Rate at which the opening changes [m/s]; chosen."""
    grip_force: ClassVar[float] = 15.0
    """Force of the gripper on each pad [N]; chosen."""
    hover_height: float = setting(0.065, "height above the part before the descent", "m", (0.04, 0.40))
    grasp_height: ClassVar[float] = 0.004
    """Height at which the jaws close [m]; chosen."""
    lift_height: float = setting(0.06, "height after the lift", "m", (0.02, 0.40))
    carry_height: ClassVar[float] = 0.05
    """Height above the cell before and after the part is put down [m]; chosen."""
    place_height: ClassVar[float] = 0.006
    """Height above the cell at which the jaws open [m]; chosen."""
    release_gap: ClassVar[float] = 0.016
    """How much wider than the part the jaws open in its cell, so that they push no neighbour [m]; chosen."""
    hand_speed: ClassVar[float] = 0.8
    """Largest speed of the hand between belt and cell [m/s]; chosen."""
    hand_acceleration: ClassVar[float] = 4.0
    """Largest acceleration of the hand [m/s^2]; chosen."""
    hand_turn_speed: ClassVar[float] = 5.4
    """Largest speed of the last joint, unless its rated speed is lower [rad/s]; chosen."""
    shortest_motion: ClassVar[float] = 0.30
    """Shortest duration of a motion between belt and cell [s]; chosen."""
    descent_duration: float = setting(0.27, "duration of the descent", "s", (0.1, 5.0))
    closing_lead: float = setting(
        0.03, "time before the end of the descent at which the jaws begin to close", "s", (0.0, 0.3)
    )
    close_timeout: ClassVar[float] = 0.5
    """Time after which jaws without a grip have missed [s]; chosen."""
    lift_duration: ClassVar[float] = 0.27
    """Duration of the lift [s]; chosen."""
    lower_duration: ClassVar[float] = 0.24
    """Duration of putting a part down [s]; chosen."""
    place_tolerance: ClassVar[float] = 0.006
    """Distance of the measured from the commanded tool up to which a part is put down [m]; chosen."""
    place_turn_tolerance_deg: ClassVar[float] = 4.0
    """The same for its direction [deg]; chosen."""
    place_timeout: ClassVar[float] = 1.0
    """Time after which a hand that does not arrive above or in the cell tries it anew [s]; chosen."""
    release_duration: ClassVar[float] = 0.12
    """Time for the jaws to open [s]; chosen."""
    raise_duration: ClassVar[float] = 0.21
    """Duration of leaving the cell [s]; chosen."""
    retreat_duration: ClassVar[float] = 0.40
    """Duration of the retreat after a miss [s]; chosen."""
    stop_duration: ClassVar[float] = 0.25
    """Time in which the operator's stop brings the hand to rest [s]; chosen."""
    manual_speed: ClassVar[float] = 0.15
    """Largest speed of the hand under the operator's control [m/s]; chosen."""
    launch_probability: float = setting(0.893, "probability of success from which on the hand descends", "", (0.0, 1.0))
    abort_probability: ClassVar[float] = 0.727
    """Probability of success below which the hand goes up again; chosen."""


@dataclass(frozen=True)
class CatchConfig:
    """The motor schema of catching.

    Heights are heights of the cup's rim above the centre of the ball when the ball leaves the board. Each setting is
    described by its ``help``.
    """

    follow: bool = setting(True, "whether the cup follows the predicted crossing; otherwise it stays in the middle")
    beyond: float = setting(0.050, "horizontal distance from the edge to the middle of the cup", "m", (0.0, 0.2))
    rim_height: ClassVar[float] = -0.035
    """Height of the rim while the cup waits [m]; chosen."""
    raised_height: ClassVar[float] = 0.085
    """Height of the rim while the cup holds the ball [m]; chosen."""
    home_duration: ClassVar[float] = 1.0
    """Duration of the motion to the middle of the edge [s]; chosen."""
    raise_duration: ClassVar[float] = 0.6
    """Duration of raising the cup [s]; chosen."""
    stop_duration: ClassVar[float] = 0.2
    """Time in which the operator's stop brings the hand to rest [s]; chosen."""
    shortest_motion: ClassVar[float] = 0.15
    """Shortest duration of a correction [s]; chosen."""
    hand_speed: ClassVar[float] = 0.75
    """Largest speed of the hand along the edge [m/s]; chosen."""
    hand_acceleration: ClassVar[float] = 10.0
    """Largest acceleration of the hand [m/s^2]; chosen."""
    manual_speed: ClassVar[float] = 0.25
    """Largest speed of the hand under the operator's control [m/s]; chosen."""
    follow_tolerance: ClassVar[float] = 0.002
    """Distance that the predicted crossing must move before the cup follows [m]; chosen."""
    settle_time: float = setting(
        0.10, "time before the arrival of the ball from which the cup stands still", "s", (0.0, 1.0)
    )
    settle_tolerance: ClassVar[float] = 0.006
    """Distance that the predicted crossing must move before a settled cup follows [m]; chosen."""
    rest_time: ClassVar[float] = 0.4
    """Time after which a ball in the cup is at rest [s]; chosen."""
    trust_time: ClassVar[float] = 0.45
    """Age up to which a predicted crossing is trusted [s]; chosen."""
    ready_after: float = setting(0.3, "time of waiting in place after which the arm is ready", "s", (0.0, 10.0))


@dataclass(frozen=True)
class TouchConfig:
    """The guarded move that touches the board. Each setting is described by its ``help``."""

    descent_speed: ClassVar[float] = 0.006
    """Largest speed of the probe while it searches the board [m/s]; chosen."""
    travel_speed: ClassVar[float] = 0.5
    """Largest speed of the probe between the marks [m/s]; chosen."""
    clearance: ClassVar[float] = 0.03
    """Height above the jogged poses at which the probe passes the pegs [m]; chosen."""
    reach_below: ClassVar[float] = 0.04
    """Depth below the jogged pose to which the board is searched [m]; chosen."""
    threshold: float = setting(2.5, "force that counts as a touch", "N", (0.1, 50.0))
    samples: int = setting(2, "consecutive samples above the threshold that make a touch", "", (1, 100))
    settle: ClassVar[float] = 0.1
    """Rest over the mark before the descent [s]; chosen."""
    force_time_constant: ClassVar[float] = 0.005
    """Time constant of the force's low-pass filter [s]; chosen."""


def touch_delay(config: GraspConfig) -> float:
    """Returns the time [s] from the start of closing until the pads touch an object in the middle of the jaws."""
    return closing_time(config, config.object_width)


def closing_time(config: GraspConfig | PickConfig, width: float) -> float:
    """Returns the time [s] in which the open jaws close to a width [m]."""
    return (config.jaw_opening - width) / config.jaw_speed
