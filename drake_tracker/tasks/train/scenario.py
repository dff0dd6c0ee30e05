"""Everything a run of the train can be told; `parts` has what it shares with other tasks, and the rules."""

import math
from dataclasses import dataclass
from typing import Union

from drake_tracker.core.setting import setting
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.scenarios.parts import BaseScenario, Custom, Lighting, Lossy, NormalFlow, Perfect, Puma560, Servo

WORK_VOLUME = [[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]]
TRACK_KINDS = ("oval", "stadium", "circle", "figure_eight", "line", "csv")


@dataclass
class Track:
    """Where the train runs, and how fast. The controller is told none of this."""

    kind: str = setting("oval", "shape of the track", choices=TRACK_KINDS)
    semi_axes: list[float] = setting([0.16, 0.22], "half extents of oval, figure_eight", "m", (0.03, 1.0), shape=(2,))
    radius: float = setting(0.12, "radius of a circle and of a stadium's ends", "m", (0.03, 1.0))
    straight: float = setting(0.20, "length of a stadium's straights", "m", (0.01, 2.0))
    length: float = setting(0.9, "length of a line", "m", (0.2, 5.0))
    csv: str = setting("", "file of a closed polyline: header x,y, metres in the world frame")
    centre: list[float] = setting([0.56, 0.0], "centre of the track in the world", "m", (-2.0, 2.0), shape=(2,))
    rotation_deg: float = setting(0.0, "rotation of the track about its centre", "deg", (-360.0, 360.0))
    centre_range: float = setting(0.03, "the seed moves the centre by up to this in x and in y", "m", (0.0, 0.5))
    rotation_range_deg: float = setting(15.0, "the seed turns the track by up to this", "deg", (0.0, 180.0))
    speed: float = setting(0.15, "mean speed of the train", "m/s", (0.0, 1.0))
    speed_law: str = setting("constant", "how the speed varies", choices=("constant", "varying", "stop_and_go"))
    variation: float = setting(0.15, "fraction by which a varying speed rises and falls", "", (0.0, 0.9))
    direction: str = setting("random", "which way round", choices=("random", "forward", "backward"))
    start: float = setting(-1.0, "where it starts, as a fraction of the track; -1: drawn by the seed", "", (-1.0, 1.0))


@dataclass
class Train:
    """What the train looks like."""

    body: str = setting("plain", "the body", choices=("plain", "striped", "round", "dark"))


@dataclass
class Cameras:
    """The two fixed cameras, left and right."""

    width: int = setting(256, "image width", "px", (16, 2048))
    height: int = setting(256, "image height", "px", (16, 2048))
    fov_deg: float = setting(30.0, "vertical field of view", "deg", (2.0, 120.0))
    distance: float = setting(1.4, "distance from look_at", "m", (0.3, 5.0))
    azimuth_deg: list[float] = setting([45.0, -45.0], "azimuths of left and right", "deg", (-180.0, 180.0), shape=(2,))
    elevation_deg: float = setting(20.0, "elevation above look_at", "deg", (1.0, 89.0))
    look_at: list[float] = setting([0.56, 0.0, 0.47], "the point both look at", "m", (-2.0, 3.0), shape=(3,))
    noise: float = setting(2.0, "standard deviation of the sensor noise", "grey levels", (0.0, 64.0))
    render_window: bool = setting(True, "render only the window of interest")
    calibration: str = setting("train_cameras.yaml", "file of the calibrated camera matrices")


@dataclass
class Rendered:
    """Vision on the rendered images of both cameras."""

    detector: NormalFlow = setting(NormalFlow, "the motion detector")
    lag_cycles: int = setting(15, "cycles from the middle image's capture to its centroid", "cycles", (1, 120))
    work_volume: list[list[float]] = setting(
        WORK_VOLUME,
        "lowest and highest corner of the box in which motion is looked for",
        "m",
        (-5.0, 5.0),
        shape=(2, 3),
    )
    outline: str = setting("ellipse", "of that box seen from above: whole, or its ellipse", choices=("box", "ellipse"))


@dataclass
class Measured:
    """The train's true place with the error that was measured in the camera loop: no image is rendered."""

    file: str = setting("train_vision.yaml", "file of the measured error, made by drake-tracker measure")
    lag_cycles: int = setting(15, "cycles from capture to point; below 2 no camera could", "cycles", (0, 120))
    work_volume: list[list[float]] = setting(
        WORK_VOLUME, "lowest and highest corner of the box in which the train is seen", "m", (-5.0, 5.0), shape=(2, 3)
    )
    outline: str = setting(
        "ellipse", "of that box from above, where the track must lie: whole, or its ellipse", choices=("box", "ellipse")
    )


@dataclass
class ArcLength:
    """The paper's filter on arc length and bending (section 4)."""

    mode: str = setting("baseline", "chords over m frames, or literally over one", choices=("baseline", "literal"))
    attenuation: float = setting(30.0, "attenuation of the Kaiser windows", "dB", (0.0, 120.0))
    order: int = setting(30, "order of the moving averages of s and its square", "", (2, 600))
    anchor_order: int = setting(10, "order for the starting point", "", (2, 600))
    heading_order: int = setting(20, "order for the direction of its chord", "", (2, 600))
    bending_order: int = setting(40, "order for the bending phi", "", (2, 600))
    baseline: int = setting(0, "frames m of a chord; 0: chosen from the noise and the speed", "frames", (0, 60))
    baseline_factor: float = setting(8.0, "length of the chord chosen, over its noise", "", (1.0, 100.0))
    start_sigma: float = setting(0.002, "noise of a point supposed at first", "m", (0.00001, 0.1))
    systematic_std: float = setting(0.005, "error of a point that the filter cannot see", "m", (0.0, 0.1))
    min_speed: float = setting(0.02, "speed below which the object rests", "m/s", (0.0, 0.5))
    restart_after: float = setting(0.3, "gap between points after which it starts afresh", "s", (0.02, 10.0))
    ready_after: float = setting(0.6, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass
class AlphaBetaGamma:
    """The authors' earlier Cartesian filter with fixed gains."""

    tracking_index: float = setting(0.001, "manoeuvre over measurement noise in x and y", "", (1e-7, 10.0))
    vertical_tracking_index: float = setting(1e-5, "the same in z, which changes little", "", (1e-7, 10.0))
    systematic_std: float = setting(0.006, "error of a point that the filter cannot see", "m", (0.0, 0.1))
    min_speed: float = setting(0.02, "speed below which the last heading is held", "m/s", (0.0, 0.5))
    restart_after: float = setting(0.3, "gap between points after which it starts afresh", "s", (0.02, 10.0))
    ready_after: float = setting(0.6, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass
class CoordinatedTurn:
    """An extended Kalman filter of an object that drives and bends as it drives."""

    speed_noise: float = setting(0.003, "how the speed wanders at least", "m/s/sqrt(s)", (1e-6, 1.0))
    bend_noise: float = setting(8.0, "how the curvature wanders with the way", "1/m/sqrt(m)", (1e-3, 1000.0))
    start_sigma: float = setting(0.002, "noise of a point supposed at first", "m", (0.00001, 0.1))
    systematic_std: float = setting(0.0, "error of a point that the filter cannot see", "m", (0.0, 0.1))
    restart_after: float = setting(1.0, "gap between points after which it starts afresh", "s", (0.02, 10.0))
    ready_after: float = setting(0.3, "time span of points needed for a prediction", "s", (0.1, 10.0))


@dataclass
class ClosedPath:
    """A filter that notices that the path comes round, learns it, and predicts along it."""

    systematic_std: float = setting(0.003, "error of a point that the filter cannot see", "m", (0.0, 0.1))


@dataclass
class Grasp:
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


@dataclass
class TrainScenario(BaseScenario):
    """A run of the train, complete."""

    table_height: float = setting(0.45, "height of the table's top", "m", (0.0, 1.5))
    track: Track = setting(Track, "the track")
    train: Train = setting(Train, "the train")
    lighting: Lighting = setting(Lighting, "the light")
    cameras: Cameras = setting(Cameras, "the cameras")
    vision: Union[Rendered, Measured] = setting(Rendered, "from images to points")
    estimator: Union[ClosedPath, CoordinatedTurn, ArcLength, AlphaBetaGamma, Custom] = setting(
        ClosedPath, "from points to predicted path"
    )
    link: Union[Perfect, Lossy] = setting(Perfect, "from the host to the arm's controller")
    servo: Servo = setting(Servo, "from packets to a pose every 30 ms")
    grasp: Grasp = setting(Grasp, "what the hand does next")
    arm: Union[Puma560, Custom] = setting(Puma560, "the arm")

    def problems(self):
        """Returns the settings that contradict each other: a list of (key, what is wrong and what to do)."""
        found = self.timing_problems(SERVO_PERIOD)
        if self.track.kind == "csv" and not self.track.csv:
            found.append(("track.csv", "must name a file when track.kind is csv"))
        if self.track.csv and self.track.kind != "csv":
            found.append(("track.kind", f"must be csv when track.csv names a file, not {self.track.kind}"))
        if -1.0 < self.track.start < 0.0:
            found.append(("track.start", "must be -1 (drawn by the seed) or a fraction from 0 to 1"))
        low, high = self.vision.work_volume
        if not all(a < b for a, b in zip(low, high)):
            found.append(("vision.work_volume", "must have its lowest corner first, then its highest"))
        if isinstance(self.vision, Rendered) and (self.vision.detector.smoothing_size or 1) % 2 == 0:
            found.append(("vision.detector.smoothing_size", "must be odd"))
        left, right = self.cameras.azimuth_deg
        if math.isclose(left, right, abs_tol=1.0):
            found.append(("cameras.azimuth_deg", "must differ by more than 1 deg, or there is no baseline"))
        return found
