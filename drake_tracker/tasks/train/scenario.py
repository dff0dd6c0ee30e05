"""The settings of a run of the train. Settings that all tasks share are in `drake_tracker.scenarios.base`."""

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from drake_tracker.arm.config import HandEyeConfig, HandKind, PacketGuardConfig, Puma560, ServoConfig
from drake_tracker.arm.description import ARMS, arms_without
from drake_tracker.core.colour import COLOUR_RULE, is_colour
from drake_tracker.core.setting import setting
from drake_tracker.core.timing import PATH_DURATION, SERVO_PERIOD
from drake_tracker.estimation.config import ArcLength
from drake_tracker.estimation.estimator import ESTIMATORS, SURFACE_ESTIMATORS
from drake_tracker.faults.kinds import faults_of
from drake_tracker.grasp.config import GraspConfig, touch_delay
from drake_tracker.grasp.jaws import WIDTH_TOLERANCE
from drake_tracker.link.config import Perfect
from drake_tracker.link.link import LINKS
from drake_tracker.measured.config import OneObject, SeveralObjects
from drake_tracker.scenarios.base import BaseScenario, Custom
from drake_tracker.scenarios.tree import Value, merge
from drake_tracker.tasks.plausible import Problems, image_problems, link_problems, set_by_user
from drake_tracker.vision.centroid.config import MotionCentroid
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.world.config import (
    CLOSED_KINDS,
    LIFTED,
    LONGEST_WALK,
    OPEN_KINDS,
    TRAIN_WIDTH,
    CamerasConfig,
    LightingConfig,
    TrackConfig,
    TrainConfig,
    WristCamera,
    body_size,
)
from drake_tracker.world.train.objects_config import OBJECTS, Train

_MEASURED_TRACKS = ("target", "confirm_after", "coast_time")
"""Settings of the former tracker that have an effect without images."""
WORK_VOLUME = ((0.33, -0.30, 0.45), (0.79, 0.30, 0.505))
"""Lowest and highest corner of the default work volume in W [m]."""
JAW_MARGIN = 0.010
"""Least width that the open jaws leave beside the object, on both sides together [m]."""
LIFT_MARGIN = 0.005
"""Height that the lift must exceed `LIFTED` by, because an arm with a load sags [m]."""


def _work_volume(words: str) -> Any:
    return setting(WORK_VOLUME, words, "m", (-5.0, 5.0), shape=(2, 3), shared=True)


def _outline() -> Any:
    words = "outline of the work volume seen from above: the box, or the ellipse in it"
    return setting("ellipse", words, choices=("box", "ellipse"), shared=True)


@dataclass(frozen=True)
class Rendered:
    """Vision on rendered images of both cameras."""

    method: MotionCentroid | SilhouetteTracker = setting(
        MotionCentroid,
        "the motion centroid of a single object, or a tracker of several",
        shared=True,
        counterparts={"OneObject": "MotionCentroid", "SeveralObjects": "SilhouetteTracker"},
    )
    lag_cycles: int = setting(
        15, "time from the capture of the middle image to its centroid", "cycles", (1, 120), shared=True
    )
    work_volume: tuple[tuple[float, ...], ...] = _work_volume(
        "lowest and highest corner of the box in which motion is searched for"
    )
    outline: str = _outline()


@dataclass(frozen=True)
class Measured:
    """Measured vision: the true position plus an error measured with cameras. No image is rendered."""

    file: str = setting("train_vision.yaml", "file of the measured error, from drake-tracker measure")
    method: OneObject | SeveralObjects = setting(
        OneObject,
        "the first train only or all objects, and which of them is followed",
        shared=True,
        counterparts={"MotionCentroid": "OneObject", "SilhouetteTracker": "SeveralObjects"},
    )
    lag_cycles: int = setting(
        15,
        "time from the capture of the middle image to the point; a camera needs at least 2",
        "cycles",
        (0, 120),
        shared=True,
    )
    work_volume: tuple[tuple[float, ...], ...] = _work_volume(
        "lowest and highest corner of the box in which the train is seen"
    )
    outline: str = _outline()


@dataclass(frozen=True)
class TrainScenario(BaseScenario):
    """All settings of a run of the train.

    Attributes:
        hand: the hand that the task needs.
    """

    COMMON: ClassVar[tuple[str, ...]] = (
        *("duration", "seed", "track.kind", "track.semi_axes", "track.radius", "track.csv"),
        *("track.rotation_deg", "track.speed", "track.direction"),
        *("train.body", "train.scale", "objects", "lighting.shadows"),
        *("cameras.noise", "cameras.calibration", "cameras.render_processes", "cameras.wrist"),
        *("vision", "vision.method", "vision.method.detector.preset", "vision.method.detector.centroid"),
        *("vision.method.target", "vision.lag_cycles", "vision.work_volume", "vision.outline"),
        *("estimator", "estimator.systematic_std", "link", "link.drop", "link.delay", "servo.tracking_index"),
        *("grasp.object_width", "grasp.hover_height", "grasp.lift_height", "grasp.settle_time"),
        *("grasp.descent", "grasp.gate", "arm", "arm.markers", "faults"),
    )
    hand: ClassVar[HandKind] = HandKind.GRIPPER
    task: str = setting("train", "name of the task")
    table_height: float = setting(0.45, "height of the table top", "m", (0.0, 1.5))
    table_colour: str = setting("", "mean colour of the table top, as #rrggbb; empty: the colour of the model")
    track: TrackConfig = setting(TrackConfig, "the track and the speed of the train")
    train: TrainConfig = setting(TrainConfig, "the train")
    objects: tuple[OBJECTS.union(), ...] = setting(  # type: ignore[valid-type]
        [], "further objects that move by themselves"
    )
    lighting: LightingConfig = setting(LightingConfig, "the lamps")
    cameras: CamerasConfig = setting(CamerasConfig, "the two fixed cameras, and one on the hand")
    vision: Rendered | Measured = setting(Rendered, "from images to points")
    estimator: ESTIMATORS.union(Custom, without=SURFACE_ESTIMATORS) = setting(  # type: ignore[valid-type]
        ArcLength, "from points to the predicted path"
    )
    link: LINKS.union() = setting(  # type: ignore[valid-type]
        Perfect, "from the host to the controller of the arm"
    )
    guard: PacketGuardConfig = setting(PacketGuardConfig, "which packets the arm follows")
    servo: ServoConfig = setting(ServoConfig, "from packets of predicted path to set-points every 30 ms")
    hand_eye: HandEyeConfig = setting(HandEyeConfig, "how the cameras' view of a hand with markers corrects its target")
    grasp: GraspConfig = setting(GraspConfig, "motions of the hand, and their conditions")
    arm: ARMS.union(Custom, without=arms_without(HandKind.GRIPPER)) = setting(  # type: ignore[valid-type]
        Puma560, "the arm"
    )
    faults: tuple[faults_of("train"), ...] = setting([], "injected faults, with their times")  # type: ignore[valid-type]

    @classmethod
    def present(cls, tree: Value, notes: list[str]) -> Value:
        """Translates ``vision.tracker`` and ``vision.detector``, which ``vision.method`` has replaced."""
        vision = tree.data.get("vision")
        if vision is None:
            return tree
        return replace(tree, data=tree.data | {"vision": _present_vision(vision, notes)})

    def problems(self) -> list[tuple[str, str]]:
        """Returns the settings that contradict each other: a list of (key path, what is required)."""
        found = self.timing_problems(SERVO_PERIOD)
        found += self._object_problems()
        if self.track.kind == "csv" and not self.track.csv:
            found.append(("track.csv", "must name a file when track.kind is csv"))
        if self.track.csv and self.track.kind != "csv":
            found.append(("track.kind", f"must be csv when track.csv names a file, not {self.track.kind}"))
        found += _track_problems("track", self.track)
        low, high = self.vision.work_volume
        if not all(a < b for a, b in zip(low, high)):
            found.append(("vision.work_volume", "must give the lowest corner first, then the highest"))
        method = self.vision.method
        if isinstance(method, MotionCentroid) and (method.detector.smoothing_size or 1) % 2 == 0:
            found.append(("vision.method.detector.smoothing_size", "must be odd"))
        left, right = self.cameras.azimuth_deg
        if math.isclose(left, right, abs_tol=1.0):
            found.append(("cameras.azimuth_deg", "must differ by more than 1 deg, or there is no baseline"))
        if isinstance(self.cameras.wrist, WristCamera) and not isinstance(method, SilhouetteTracker):
            found.append(("cameras.wrist", "a camera on the hand needs vision.method: !SilhouetteTracker"))
        if isinstance(self.vision, Rendered):
            found += image_problems("cameras", self.cameras.width, self.cameras.height, cameras=2)
        if isinstance(self.vision, Measured) and isinstance(self.arm, Puma560) and self.arm.markers:
            found.append(("arm.markers", "must be false with vision !Measured, which has no images of the hand"))
        late = link_problems(self, self.link)
        return found + late + ([] if late else grasp_problems(self))

    def _object_problems(self) -> list[tuple[str, str]]:
        """Returns the problems of colours and further objects, in the form of `problems`."""
        found = []
        colours = {"table_colour": (self.table_colour, True), "train.colour": (self.train.colour, True)}
        for number, item in enumerate(self.objects):
            key = f"objects[{number}]"
            colours[f"{key}.colour"] = (item.colour, isinstance(item, Train))
            own = item.track if isinstance(item, Train) else None
            if own is not None and own.kind == "csv":
                found.append((f"{key}.track.kind", "must not be csv: only the first train runs on a track from a file"))
            if own is not None:
                found += _track_problems(f"{key}.track", own)
        for key, (colour, may_be_empty) in colours.items():
            if not is_colour(colour) and (colour or not may_be_empty):
                rule = f"{COLOUR_RULE}{', or empty' if may_be_empty else ''}"
                found.append((key, f"{rule}, not {colour!r}"))
        return found


def _track_problems(key: str, track: TrackConfig) -> list[tuple[str, str]]:
    """Returns the settings of a track that contradict each other, in the form of `TrainScenario.problems`.

    Args:
        key: path of the track, for example "track".
        track: its settings.
    """
    found = []
    if -1.0 < track.start < 0.0:
        found.append((f"{key}.start", "must be -1 (drawn by the seed) or a fraction from 0 to 1"))
    if not track.closed and track.kind in CLOSED_KINDS:
        open_kinds = ", ".join((*OPEN_KINDS[:-1], f"{OPEN_KINDS[-1]} or csv"))
        found.append((f"{key}.closed", f"must be true: the kind {track.kind} is always closed; choose {open_kinds}"))
    if track.bank_deg and not track.heights:
        found.append((f"{key}.bank_deg", f"must be 0 on a level track; {key}.heights raises it"))
    if track.kind == "random_walk":
        if track.length > LONGEST_WALK:
            found.append((f"{key}.length", f"must be at most {LONGEST_WALK:g} m when {key}.kind is random_walk"))
        if track.straight_range[0] > track.straight_range[1]:
            found.append((f"{key}.straight_range", "must give the shortest straight first, then the longest"))
    return found


def grasp_of(scenario: TrainScenario) -> GraspConfig:
    """Returns the settings of the grasp, with the size of the object that is grasped.

    Args:
        scenario: of the train.
    """
    grasp, (length, width, _) = scenario.grasp, body_size(scenario.train.body, scenario.train.scale)
    width = width if grasp.object_width == TRAIN_WIDTH else grasp.object_width
    return replace(grasp, object_width=width, turns=scenario.track.turns, reach=0.5 * length)


def grasp_problems(scenario: TrainScenario) -> Problems:
    """Returns the settings of the grasp that contradict the object, the judge, or each other.

    Args:
        scenario: of the train.
    """
    grasp = grasp_of(scenario)
    found: Problems = []
    if grasp.object_width <= WIDTH_TOLERANCE:
        words = f"must be above {WIDTH_TOLERANCE:g} m, or jaws that closed on nothing would count as a grip"
        found.append(("grasp.object_width", words))
    width = max(grasp.object_width, body_size(scenario.train.body, scenario.train.scale)[1])
    if grasp.jaw_opening < width + JAW_MARGIN:
        words = (
            f"leaves the jaws too narrow: they open to {grasp.jaw_opening:g} m, and an object of {width:g} m needs "
            f"{width + JAW_MARGIN:g} m"
        )
        found.append((set_by_user(scenario, ["grasp.jaw_opening", "grasp.object_width"]), words))
    if grasp.closing_lead > grasp.descent_duration:
        words = (
            f"lets the jaws close before the descent begins: grasp.closing_lead is {grasp.closing_lead:g} s, "
            f"grasp.descent_duration {grasp.descent_duration:g} s"
        )
        found.append((set_by_user(scenario, ["grasp.closing_lead", "grasp.descent_duration"]), words))
    needed = LIFTED + LIFT_MARGIN + grasp.grasp_height
    if grasp.lift_height < needed:
        words = f"must be at least {needed:g} m: the object counts as lifted from {LIFTED:g} m above its track"
        found.append(("grasp.lift_height", words))
    return found + _blind_time_problems(scenario)


def _blind_time_problems(scenario: TrainScenario) -> Problems:
    """Returns a problem when a predicted path ends before the jaws would touch the object."""
    grasp, lag = grasp_of(scenario), scenario.lag
    descent = grasp.descent_duration - grasp.closing_lead + touch_delay(grasp)
    if lag + descent <= PATH_DURATION:
        return []
    words = (
        f"leaves no time for a grasp: a packet predicts {PATH_DURATION:g} s from its image on, of which vision "
        f"takes {lag:.3g} s, descent and closing {descent:.3g} s"
    )
    return [(set_by_user(scenario, ["vision.lag_cycles", "grasp.descent_duration"]), words)]


def _present_vision(vision: Value, notes: list[str]) -> Value:
    """Returns the tree of a vision with its former settings translated, see `BaseScenario.present`."""
    if not isinstance(vision.data, dict):
        return vision
    data = dict(vision.data)
    measured = vision.tag == "Measured"
    tracker, detector = data.pop("tracker", None), None if measured else data.pop("detector", None)
    method = None
    if tracker is not None:
        several = tracker.tag == "Several"
        if measured:
            kept = {name: tracker.data[name] for name in _MEASURED_TRACKS if name in (tracker.data or {})}
            method = replace(tracker, data=kept, tag="SeveralObjects" if several else "OneObject")
        else:
            tag = {"Single": "MotionCentroid", "Several": "SilhouetteTracker"}.get(str(tracker.tag), tracker.tag)
            method = replace(tracker, tag=tag)
        kind = f", here !{method.tag}" if method.tag else ""
        notes.append(f"{tracker.origin}: vision.tracker is now called vision.method{kind}")
    if detector is not None and (tracker is None or tracker.tag != "Several"):  # it had no effect with !Several
        nested = Value({"detector": detector}, detector.origin, None, detector.in_file)
        method = nested if method is None else merge(method, nested)
        notes.append(f"{detector.origin}: vision.detector is now called vision.method.detector")
    if method is not None:
        data["method"] = merge(data["method"], method) if "method" in data else method
    replaced = None if vision.replaced is None else _present_vision(vision.replaced, [])
    return replace(vision, data=data, replaced=replaced)
