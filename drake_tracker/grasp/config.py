"""Settings of the motor schemas, which are also the parameters of their machines."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class GraspConfig:
    """The motor schema of grasping: the known width of the object, heights, durations, and conditions of the gate.

    Heights are those of the tool above the object's reference point, at which its motion is seen. This point lies a few
    millimetres below the centre of the body, since the wheels move too: jaws that close slightly above it close on the
    middle of the body. Each setting is described by its ``help``.
    """

    object_width: float = setting(0.040, "width of the object between the jaws", "m", (0.005, 0.085))
    jaw_opening: float = setting(0.088, "opening of the jaws before the grasp", "m", (0.010, 0.090))
    jaw_speed: float = setting(0.40, "rate at which the opening changes", "m/s", (0.02, 0.40))
    grip_force: float = setting(25.0, "force of the gripper on each pad", "N", (1.0, 25.0))
    hover_height: float = setting(0.22, "height while tracking", "m", (0.10, 0.40))
    grasp_height: float = setting(0.004, "height at which the jaws close", "m", (-0.01, 0.03))
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
    close_timeout: float = setting(0.5, "time after which jaws without a grip have missed", "s", (0.2, 5.0))
    lift_duration: float = setting(1.0, "duration of the lift", "s", (0.2, 10.0))
    retreat_duration: float = setting(
        1.0, "duration of the retreat after a miss, and of the motion home", "s", (0.2, 10.0)
    )
    settle_time: float = setting(0.5, "time above the object before an intercept", "s", (0.0, 60.0))
    stop_duration: float = setting(0.25, "time in which the operator's stop brings the hand to rest", "s", (0.05, 2.0))
    manual_speed: float = setting(0.15, "largest speed of the hand under the operator's control", "m/s", (0.01, 1.0))
    when_stale: str = setting(
        "coast",
        "what to do while no packets arrive: follow the predicted path, or stand still",
        choices=("coast", "hold"),
    )
    silence: float = setting(
        1.0, "time without a new packet after which the hand stands still, high above the object", "s", (0.03, 10.0)
    )
    gate: str = setting(
        "auto",
        "evidence that a prediction needs; probability: launch_probability; auto: memory or recent",
        choices=("probability", "auto", "memory", "recent"),
    )
    launch_probability: float = setting(
        0.9, "with gate probability: probability of success from which on the hand descends", "", (0.0, 1.0)
    )
    abort_probability: float = setting(
        0.1, "in a guided descent: probability of success below which the hand goes up again", "", (0.0, 1.0)
    )
    memory_radius: float = setting(0.03, "distance below which an earlier place counts as the same", "m", (0.001, 0.2))
    lateral_tolerance: float = setting(0.012, "largest prediction error across the path", "m", (0.0, 0.1))
    along_tolerance: float = setting(0.030, "largest prediction error along the path", "m", (0.0, 0.2))
    std_tolerance: float = setting(
        0.005, "predicted standard deviation at the grasp below which the filter is trusted", "m", (0.0, 0.1)
    )
    turn_tolerance_deg: float = setting(15.0, "largest prediction error in direction", "deg", (0.0, 90.0))
    straight_length: float = setting(
        0.25, "length of a straight path from which the track counts as open", "m", (0.05, 2.0)
    )
    straight_tolerance: float = setting(
        0.008, "distance from a line up to which a path counts as straight", "m", (0.0, 0.1)
    )


@dataclass(frozen=True)
class PickConfig:
    """The motor schema of picking parts from a belt and placing them.

    Heights are those of the tool above the origin of the part, or of its cell: half the height of the part above what
    it lies on. Each setting is described by its ``help``.
    """

    jaw_opening: float = setting(0.088, "opening of the jaws before the pick", "m", (0.010, 0.090))
    jaw_speed: float = setting(0.40, "rate at which the opening changes", "m/s", (0.02, 0.40))
    grip_force: float = setting(15.0, "force of the gripper on each pad", "N", (1.0, 25.0))
    hover_height: float = setting(0.065, "height above the part before the descent", "m", (0.04, 0.40))
    grasp_height: float = setting(0.004, "height at which the jaws close", "m", (-0.01, 0.03))
    lift_height: float = setting(0.06, "height after the lift", "m", (0.02, 0.40))
    carry_height: float = setting(0.05, "height above the cell before and after the part is put down", "m", (0.02, 0.4))
    place_height: float = setting(0.006, "height above the cell at which the jaws open", "m", (-0.01, 0.05))
    release_gap: float = setting(
        0.016,
        "how much wider than the part the jaws open in its cell, so that they push no neighbour",
        "m",
        (0.004, 0.06),
    )
    hand_speed: float = setting(0.8, "largest speed of the hand between belt and cell", "m/s", (0.05, 3.0))
    hand_acceleration: float = setting(4.0, "largest acceleration of the hand", "m/s^2", (0.1, 100.0))
    hand_turn_speed: float = setting(
        5.4, "largest speed of the last joint, unless its rated speed is lower", "rad/s", (0.1, 30.0)
    )
    shortest_motion: float = setting(0.30, "shortest duration of a motion between belt and cell", "s", (0.05, 5.0))
    descent_duration: float = setting(0.27, "duration of the descent", "s", (0.1, 5.0))
    closing_lead: float = setting(
        0.03, "time before the end of the descent at which the jaws begin to close", "s", (0.0, 0.3)
    )
    close_timeout: float = setting(0.5, "time after which jaws without a grip have missed", "s", (0.2, 5.0))
    lift_duration: float = setting(0.27, "duration of the lift", "s", (0.1, 10.0))
    lower_duration: float = setting(0.24, "duration of putting a part down", "s", (0.1, 10.0))
    place_tolerance: float = setting(
        0.006, "distance of the measured from the commanded tool up to which a part is put down", "m", (0.001, 0.05)
    )
    place_turn_tolerance_deg: float = setting(4.0, "the same for its direction", "deg", (0.5, 90.0))
    place_timeout: float = setting(
        1.0, "time after which a hand that does not arrive above or in the cell tries it anew", "s", (0.1, 60.0)
    )
    release_duration: float = setting(0.12, "time for the jaws to open", "s", (0.03, 5.0))
    raise_duration: float = setting(0.21, "duration of leaving the cell", "s", (0.1, 10.0))
    retreat_duration: float = setting(0.40, "duration of the retreat after a miss", "s", (0.1, 10.0))
    stop_duration: float = setting(0.25, "time in which the operator's stop brings the hand to rest", "s", (0.05, 2.0))
    manual_speed: float = setting(0.15, "largest speed of the hand under the operator's control", "m/s", (0.01, 1.0))
    launch_probability: float = setting(0.9, "probability of success from which on the hand descends", "", (0.0, 1.0))
    abort_probability: float = setting(0.1, "probability of success below which the hand goes up again", "", (0.0, 1.0))


@dataclass(frozen=True)
class CatchConfig:
    """The motor schema of catching.

    Heights are those of the cup's rim above the ball's centre where it leaves the board. Each setting is described by
    its ``help``.
    """

    follow: bool = setting(True, "whether the cup follows the predicted crossing; otherwise it stays in the middle")
    beyond: float = setting(0.050, "horizontal distance from the edge to the middle of the cup", "m", (0.0, 0.2))
    rim_height: float = setting(-0.035, "height of the rim while the cup waits", "m", (-0.1, 0.02))
    raised_height: float = setting(0.085, "height of the rim while the cup holds the ball", "m", (0.0, 0.4))
    home_duration: float = setting(1.0, "duration of the motion to the middle of the edge", "s", (0.2, 10.0))
    raise_duration: float = setting(0.6, "duration of raising the cup", "s", (0.2, 10.0))
    stop_duration: float = setting(0.2, "time in which the operator's stop brings the hand to rest", "s", (0.05, 2.0))
    shortest_motion: float = setting(0.15, "shortest duration of a correction", "s", (0.02, 2.0))
    hand_speed: float = setting(0.75, "largest speed of the hand along the edge", "m/s", (0.05, 3.0))
    hand_acceleration: float = setting(10.0, "largest acceleration of the hand", "m/s^2", (0.1, 100.0))
    manual_speed: float = setting(0.25, "largest speed of the hand under the operator's control", "m/s", (0.01, 1.0))
    follow_tolerance: float = setting(
        0.002, "distance that the predicted crossing must move before the cup follows", "m", (0.0, 0.05)
    )
    settle_time: float = setting(
        0.10, "time before the arrival of the ball from which the cup stands still", "s", (0.0, 1.0)
    )
    settle_tolerance: float = setting(
        0.006, "distance that the predicted crossing must move before a settled cup follows", "m", (0.0, 0.1)
    )
    rest_time: float = setting(0.4, "time after which a ball in the cup is at rest", "s", (0.05, 5.0))
    trust_time: float = setting(0.45, "age up to which a predicted crossing is trusted", "s", (0.05, 5.0))
    ready_after: float = setting(0.3, "time of waiting in place after which the arm is ready", "s", (0.0, 10.0))


@dataclass(frozen=True)
class TouchConfig:
    """The guarded move that touches the board. Each setting is described by its ``help``."""

    descent_speed: float = setting(0.006, "largest speed of the probe while it searches the board", "m/s", (0.001, 0.1))
    travel_speed: float = setting(0.5, "largest speed of the probe between the marks", "m/s", (0.01, 1.0))
    clearance: float = setting(
        0.03, "height above the jogged poses at which the probe passes the pegs", "m", (0.0, 0.2)
    )
    reach_below: float = setting(0.04, "depth below the jogged pose to which the board is searched", "m", (0.001, 0.2))
    threshold: float = setting(2.5, "force that counts as a touch", "N", (0.1, 50.0))
    samples: int = setting(2, "consecutive samples above the threshold that make a touch", "", (1, 100))
    settle: float = setting(0.1, "rest over the mark before the descent", "s", (0.0, 5.0))
    force_time_constant: float = setting(0.005, "time constant of the force's low-pass filter", "s", (0.001, 1.0))


def touch_delay(config: GraspConfig) -> float:
    """Returns the time [s] from the start of closing until the pads touch an object in the middle of the jaws."""
    return closing_time(config, config.object_width)


def closing_time(config: GraspConfig | PickConfig, width: float) -> float:
    """Returns the time [s] in which the open jaws close to a width [m]."""
    return (config.jaw_opening - width) / config.jaw_speed
