"""Settings of the motor schemas."""

from dataclasses import dataclass

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class GraspConfig:
    """The motor schema: what is known of the object beforehand, heights, durations, and what opens the gate.

    Heights are of the tool above the object's reference point, where its motion was seen. That lies a few millimetres
    below the centre of its body, since wheels move too: jaws that close a little higher close on the middle.
    """

    object_width: float = setting(0.040, "width of the object between the jaws", "m", (0.005, 0.085))
    jaw_opening: float = setting(0.088, "opening of the jaws before the grasp", "m", (0.010, 0.090))
    jaw_speed: float = setting(0.40, "rate at which the opening changes", "m/s", (0.02, 0.40))
    grip_force: float = setting(25.0, "force on each pad that the gripper's drive gives", "N", (1.0, 25.0))
    hover_height: float = setting(0.22, "height while tracking", "m", (0.10, 0.40))
    grasp_height: float = setting(0.004, "height at which the jaws close", "m", (-0.01, 0.03))
    lift_height: float = setting(0.15, "height after the lift", "m", (0.02, 0.40))
    approach_duration: float = setting(1.0, "time to get above the object", "s", (0.2, 10.0))
    descent_duration: float = setting(0.36, "time of the descent", "s", (0.2, 5.0))
    closing_lead: float = setting(0.06, "how long before the descent ends the jaws begin to close", "s", (0.0, 0.3))
    close_timeout: float = setting(0.5, "time after which jaws that felt no grip have missed", "s", (0.2, 5.0))
    lift_duration: float = setting(1.0, "time of the lift", "s", (0.2, 10.0))
    retreat_duration: float = setting(1.0, "time of the retreat after a miss, and of going home", "s", (0.2, 10.0))
    settle_time: float = setting(0.5, "time above the object before an intercept", "s", (0.0, 60.0))
    when_stale: str = setting(
        "coast", "while no packets come: follow the path foreseen, or stand still", choices=("coast", "hold")
    )
    gate: str = setting("auto", "what vouches for a prediction; auto: all", choices=("auto", "memory", "recent"))
    memory_radius: float = setting(0.03, "how near an earlier place counts as the same", "m", (0.001, 0.2))
    lateral_tolerance: float = setting(0.012, "error across the path that the gate allows", "m", (0.0, 0.1))
    along_tolerance: float = setting(0.030, "error along the path that the gate allows", "m", (0.0, 0.2))
    std_tolerance: float = setting(0.005, "a filter this sure of the grasp's place is believed", "m", (0.0, 0.1))
    turn_tolerance_deg: float = setting(15.0, "error in direction that the gate allows", "deg", (0.0, 90.0))
    straight_length: float = setting(0.25, "a path straight all along, so far, is an open track", "m", (0.05, 2.0))
    straight_tolerance: float = setting(0.008, "distance from a line that still counts as straight", "m", (0.0, 0.1))


@dataclass(frozen=True)
class CatchConfig:
    """The motor schema of catching. Heights are of the cup's rim above the ball's centre where it leaves the board."""

    follow: bool = setting(True, "whether the cup follows the foreseen crossing; else it stays in the middle")
    beyond: float = setting(0.050, "horizontal distance from the edge to the middle of the cup", "m", (0.0, 0.2))
    rim_height: float = setting(-0.035, "height of the rim while it waits", "m", (-0.1, 0.02))
    raised_height: float = setting(0.085, "height of the rim once it holds the ball", "m", (0.0, 0.4))
    home_duration: float = setting(1.0, "time to go to the middle of the edge", "s", (0.2, 10.0))
    raise_duration: float = setting(0.6, "time in which the cup is raised", "s", (0.2, 10.0))
    stop_duration: float = setting(0.2, "time in which the operator's stop brings the hand to rest", "s", (0.05, 2.0))
    shortest_motion: float = setting(0.15, "shortest time of a correction", "s", (0.02, 2.0))
    hand_speed: float = setting(0.75, "greatest speed of the hand along the edge", "m/s", (0.05, 3.0))
    hand_acceleration: float = setting(10.0, "greatest acceleration of the hand", "m/s^2", (0.1, 100.0))
    manual_speed: float = setting(0.25, "speed of the hand when the operator has taken over", "m/s", (0.01, 1.0))
    follow_tolerance: float = setting(0.002, "a crossing that moved by less is still the same", "m", (0.0, 0.05))
    settle_time: float = setting(0.10, "time before the ball comes from which the cup stands still", "s", (0.0, 1.0))
    settle_tolerance: float = setting(0.006, "a crossing that moved by more is followed even then", "m", (0.0, 0.1))
    rest_time: float = setting(0.4, "time after which a ball has come to rest in the cup", "s", (0.05, 5.0))
    trust_time: float = setting(0.45, "age up to which a foreseen crossing is believed", "s", (0.05, 5.0))
    ready_after: float = setting(0.3, "time of waiting in place after which the arm is ready", "s", (0.0, 10.0))
