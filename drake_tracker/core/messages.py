"""The vector messages on the ports between the subsystems: all named views of the package.

Every signal except an image is a plain vector port, so that ``LogVectorOutput``, ``DiscreteTimeDelay`` and the link
carry it unchanged. A port that has produced nothing yet is all zeros, hence ``valid == 0``. ``stamp`` is always the
capture time [s] of the image that the value describes, never the time at which the value was computed.
"""

from enum import IntEnum
from typing import Any

import numpy as np
from pydrake.common.containers import namedview

from drake_tracker.core.timing import KNOT_COUNT, KNOT_SPACING

KNOT_FIELDS = ("x", "y", "z", "yaw", "std")
"""Columns of a knot: position in W [m]; yaw about W's z axis, continuous along the path [rad]; predicted standard
deviation [m]."""

FrameInfo = namedview("FrameInfo", ["stamp", "fresh"])
"""Describes the image that a `VideoSource` outputs: its capture time [s]; ``fresh`` = 0 when no image was captured in
this cycle."""

Centroid = namedview("Centroid", ["stamp", "u", "v", "pixel_count", "valid"])
"""Motion centroid in one image: stamp [s]; u and v [px] in full-frame pixel coordinates, where pixel centres have whole
coordinates; number of moving pixels."""

TrackPoint = namedview("TrackPoint", ["stamp", "x", "y", "z", "gap", "valid"])
"""A measured point: stamp [s]; p_WQ = (x, y, z) [m] in W; gap between the two rays of sight [m]."""

WristPoint = namedview(
    "WristPoint",
    ["stamp", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz", "correlation", "reason", "source", "valid"],
)
"""Measurement of the target by the camera on the hand: stamp [s]; p_WQ [m] in W; its covariance [m^2]; correlation of
the image with the learned appearance; why there is no measurement (`vision.hand.wrist_measurement.WristReason`); which
cameras the point of the target comes from (0 none, 1 the fixed ones, 2 the one on the hand, 3 all); valid."""

REGION_SLOTS = 16
"""Regions of one image that a message holds."""
REGION_FIELDS = ("u", "v", "pixels", "width", "height", "var_u", "var_v", "moving", "share", "track", "shared")
"""Fields of a region: centroid [px, full frame], number of pixels, extents [px], variances of the centroid [px^2],
share of its pixels that move, visible share of the object, number of its track (0: none, -1: not yet confirmed), 1 if
it was cut out of a silhouette that shows several objects."""
Regions = namedview(
    "Regions",
    ["stamp", "count", "usable", "camera", "displacement"]
    + [f"{field}{k}" for k in range(REGION_SLOTS) for field in REGION_FIELDS],
)
"""Content of one image: stamp [s]; number of regions, which may exceed the slots; ``usable`` = 0 when the image could
not be compared with the background; number of the `vision.camera_motion.Verdict`, in its order, and displacement of the
image by motion of the camera itself [px]; and `REGION_SLOTS` regions of `REGION_FIELDS`, all zeros where there is
none."""


class TrackState(IntEnum):
    """Visibility of an object. Messages and logs contain these numbers."""

    NONE = 0
    MOVING = 1
    STANDING = 2
    OCCLUDED = 3
    NOT_OBSERVED = 4
    OUT_OF_VIEW = 5
    MERGED = 6


TRACK_SLOTS = 8
"""Tracks that a message holds."""
TRACK_FIELDS = ("number", "state", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz") + (
    "vx",
    "vy",
    "vz",
    "gap",
    "seen",
    "size",
    "red",
    "green",
    "blue",
    "yaw",
    "yaw_known",
)
"""Fields of a track: identity (0: empty slot); `TrackState`; position in W [m], measured
where the object is seen and predicted otherwise; covariance of the position [m^2]; velocity [m/s]; gap between the rays
[m]; stamp at which it was last seen [s]; largest dimension [m]; colour [grey levels]; direction in which an object at
rest lies [rad], up to half a turn, and 1 if the images have shown it."""
TrackPoints = namedview(
    "TrackPoints",
    ["stamp", "target", "reason", "overflow", "valid"]
    + [f"{field}{k}" for k in range(TRACK_SLOTS) for field in TRACK_FIELDS],
)
"""All tracks: stamp [s]; number of the target (0: none); why there is no point of it
(`vision.silhouettes.target.Reason`); number of regions and tracks that found no slot; valid; `TRACK_SLOTS` tracks."""

EXPECTED_FIELDS = ("number", "x", "y", "z", "vx", "vy", "vz", "std")
"""Fields of an expectation: identity of the track (0: empty slot); position [m], velocity [m/s] and standard deviation
of the position [m] in W."""
TrackPredictions = namedview(
    "TrackPredictions", ["time"] + [f"{field}{k}" for k in range(TRACK_SLOTS) for field in EXPECTED_FIELDS]
)
"""Where the estimators expect the objects that vision has lost sight of: time for which they predict [s], and
`TRACK_SLOTS` expectations."""

PART_SLOTS = 16
"""Parts on the belt that a message holds."""
PART_FIELDS = ("number", "kind", "x", "y", "z", "yaw", "var_along", "var_across", "var_yaw", "seen")
"""Fields of a part as vision sees it: identity (0: empty slot); `core.part_kinds.PartKind`; p_WP [m]; direction of x_P
in W [rad]; variances of the position along and across the belt [m^2] and of the direction [rad^2]; stamp at which it
was last seen [s]."""
PartTracks = namedview(
    "PartTracks", ["stamp", "valid"] + [f"{field}{k}" for k in range(PART_SLOTS) for field in PART_FIELDS]
)
"""The parts on the belt: stamp [s], valid, and `PART_SLOTS` parts."""

BELT_FIELDS = ("number", "kind", "x", "y", "z", "yaw", "speed", "std", "yaw_std", "clear")
"""Fields of a part as estimated: identity (0: empty slot); `core.part_kinds.PartKind`; p_WP [m]; direction of x_P in W
[rad]; its own speed along the belt [m/s]; standard deviations of the position along the belt [m] and of the direction
[rad]; distance to the outline of the nearest other part [m]."""
BeltEstimate = namedview(
    "BeltEstimate",
    ["stamp", "speed", "speed_std", "valid"] + [f"{field}{k}" for k in range(PART_SLOTS) for field in BELT_FIELDS],
)
"""The estimated belt: time for which the estimate holds [s], speed of the belt and its standard deviation [m/s], valid,
and `PART_SLOTS` parts."""

EncoderReading = namedview("EncoderReading", ["time", "distance", "valid"])
"""Measurement of the belt's encoder: time [s] and distance travelled since the start [m]."""

EncoderReport = namedview("EncoderReport", ["used", "unused_cycles"])
"""Use of the encoder by the host: whether the host uses the encoder now, and the number of cycles so far without it."""

PickOrder = namedview(
    "PickOrder",
    ["stamp", "seq", "job", "number", "kind", "width", "height", "place_x", "place_y", "place_z", "place_yaw"]
    + ["cell", "valid"],
)
"""Order to the arm: time at which the host gave the order [s]; sequence number of the message, which is repeated;
number of the job; number of the part to pick (packets say where it is; 0: none); `core.part_kinds.PartKind`; width
between the jaws and height [m]; pose in W of the frame P of the part in its cell [m, rad]; number of the cell."""

PickDiagnosis = namedview(
    "PickDiagnosis", ["phase", "job", "done", "attempts", "picked", "placed", "failed", "gate", "p_success"]
)
"""For the log, and for the host: phase; number of the job in work (0: none), and of the last one that was done or
failed; numbers of picks begun, of parts that the jaws held after the lift, of parts put down, and of jobs that failed;
why the hand waits (`grasp.gate.Gate`); probability that a pick would succeed."""

Filtered = namedview("Filtered", ["stamp", "x", "y", "z", "yaw", "speed", "valid"])
"""The filtered state at the newest stamp [s]: position in W [m], direction of travel (yaw) [rad], speed [m/s]."""

Prediction = namedview(
    "Prediction",
    ["stamp", "seq", "first_time", "spacing", "valid"]
    + [f"{field}{k}" for k in range(KNOT_COUNT) for field in KNOT_FIELDS],
)
"""A packet of predicted path: stamp [s] of the newest measurement used, sequence number, time of the first knot [s],
spacing of the knots [s], valid, and `KNOT_COUNT` knots of `KNOT_FIELDS`. The first knot is the filtered state at
``stamp`` itself."""

TARGET_STRIDE = 10**9
"""A host that tracks several objects adds this times the number of the track to the sequence numbers of its packets."""
PREDICTION_HEADER = 5
"""Number of fields of a `Prediction` before its first knot."""
_FIRST_TIME, _SPACING = (Prediction.get_fields().index(name) for name in ("first_time", "spacing"))

HandPoint = namedview("HandPoint", ["stamp", "seq", "x", "y", "z", "gap", "markers", "valid"])
"""The robot's own hand as the cameras see it: stamp [s], sequence number, tool point p_WT = (x, y, z) [m] in W,
displaced by vision's error as an object below it would be; gap between the two rays [m]; number of markers seen in both
images together."""

HandCorrection = namedview("HandCorrection", ["time", "x", "y", "z", "used", "accepted", "rejected", "reason"])
"""Correction that the arm subtracts from the position of its target [m], in W: time [s]; the correction (x, y, z);
``used`` = 0 while it rests on no recent measurement of the hand; number of measurements accepted so far, and of those
rejected; why the newest of these was rejected (`arm.hand_eye_correction.Doubt`, 0: none yet)."""

PacketReport = namedview(
    "PacketReport",
    ["received", "rejected", "reason", "not_finite", "malformed", "spacing", "first_time", "future", "past"]
    + ["outside", "below_table", "too_fast", "turning"],
)
"""Counts of the arm's receiver so far: packets received; packets rejected; reason of the newest rejection
(`arm.safety.packet_guard.Rejection`, 0: none yet); and the number of packets rejected for each reason."""

LimiterReport = namedview(
    "LimiterReport",
    ["changed", "invalid", "position", "speed", "acceleration", "torque", "obstacle", "link", "contact"],
)
"""Counts of the joint limiter so far: set-points changed, and set-points changed for each limit
(`arm.safety.joint_limiter.Limit`); several limits may hold for one set-point."""

ServoTarget = namedview(
    "ServoTarget",
    ["time", "x", "y", "z", "yaw", "vx", "vy", "vz", "yaw_rate", "stamp", "seq", "std", "stale", "valid"],
)
"""The servo's estimate of the object: its filtered pose and rates at ``time`` [s], the instant at which the set-point
now being computed is due; stamp and seq of the packet on which it is based; the packet's std [m] at that time;
``stale`` = 1 while the servo coasts without a fresh packet."""

ArmCommand = namedview("ArmCommand", ["phase", "motion", "duration", "frame", "height", "frozen", "jaw_width"])
"""Command of the motor schema to the arm: number of the phase; counter that starts a new straight-line motion when it
changes; duration of that motion [s]; ``frame`` in which to move (0 home, 1 with the object, 2 at rest where the object
was when the motion began, 3 at the goal of the decision); height of the tool above the object's reference point, square
to its surface [m]; ``frozen``, a `Frozen`; jaw opening [m]."""


class Frozen(IntEnum):
    """The reference frame of a motion of the arm.

    FREE: nothing. BLIND: the arm follows the packet that it held when the descent began, and its jaws do not turn over.
    GUIDED: it follows new packets, quickly, and its jaws do not turn over.
    """

    FREE = 0
    BLIND = 1
    GUIDED = 2


ToolStatus = namedview("ToolStatus", ["motion", "fraction", "flipping", "x", "y", "z", "yaw", "branch"])
"""State of the commanded tool: counter of the motion; completed fraction of it (0 to 1); ``flipping`` = 1 while the
jaws turn by 180 deg; commanded p_WT [m] and yaw [rad]; number of half turns of the jaws."""

JawState = namedview("JawState", ["width", "speed", "force"])
"""Measurement of the gripper: opening between the pads [m], its rate [m/s], force of the drive on each pad [N]."""

GraspDiagnosis = namedview("GraspDiagnosis", ["phase", "attempts", "gate", "remembered_error", "records", "p_success"])
"""For the log: phase; number of attempts begun; why the machine waits (`grasp.gate.Gate`); largest lateral error [m]
remembered for this place; number of predictions judged so far; probability that a grasp would succeed."""

OperatorCommand = namedview("OperatorCommand", ["mode", "x", "y", "z", "yaw", "selected"])
"""The operator's command: ``mode`` 0 supervise, 1 stop, 2 take over and move to the tool pose p_WT [m], yaw [rad];
number of the track that the operator selected as the target (0: none)."""

CatchDiagnosis = namedview("CatchDiagnosis", ["phase", "known", "time_left", "x", "y", "std", "motions"])
"""For the log: phase; whether a crossing of the bottom edge was ever predicted; time until it [s]; where the ball will
pass over the cup [m, W]; standard deviation of that position [m]; number of straight-line motions begun."""

TouchReport = namedview("TouchReport", ["phase", "mark", "force"] + [f"{axis}{k}" for k in range(3) for axis in "xyz"])
"""Progress of touching the board: phase (`grasp.ball.touch_machine.TouchPhase`); number of the mark (0 to 2); force
against the approach [N]; positions of the probe's centre at each touch, p_WP [m] in W, zero before the touch."""

Verdict = namedview(
    "Verdict",
    ["lift", "left_contact", "right_contact", "held_since", "held", "taken", "derailed", "table_touched"]
    + ["self_touched"],
)
"""The judge's findings on the train: height above the rail [m]; whether each finger touches the train; time at which
the current hold began [s] (0: not held) and its duration [s]; ``taken`` = 1 once the train was held long enough;
``derailed`` = 1 while it rests off its track without contact with a finger and cannot return; ``table_touched`` = 1
once the arm touched the table; ``self_touched`` = 1 once two of its links touched each other."""

CatchVerdict = namedview(
    "CatchVerdict",
    ["height", "x", "y", "in_cup", "held_since", "held", "caught", "released", "crossing_x", "crossing_time"]
    + ["left_board", "rest_since", "lost", "board_touched", "self_touched"],
)
"""The judge's findings on the ball: height of its centre above the floor [m]; its (x, y)_B [m]; ``in_cup`` = 1 while
its centre is inside the bowl and the hand touches it; time at which the current hold in the cup, off the board, began
[s] (0: not held) and its duration [s]; ``caught`` = 1 once it was held long enough; time of the release [s] (0: not
yet); where (x_B [m]) and when [s] its centre first crossed the bottom edge (time 0: not yet); time at which it left the
board, below the edge and without touching it [s] (0: not yet); time at which it came to rest on the board [s] (0: it
moves); ``lost`` = 1 once it touched table or floor, or is jammed; ``board_touched`` = 1 once the arm touched the board
or its table; ``self_touched`` = 1 once two links of the arm touched each other."""

PickVerdict = namedview(
    "PickVerdict",
    ["coming", "arrived", "picked", "placed", "missed", "dropped", "doubles", "held"]
    + ["belt_touched", "tray_touched", "table_touched", "self_touched"],
)
"""The judge's findings on the parts: numbers of parts that have not arrived yet, that have arrived, that were ever held
off the belt, and that are placed, missed and dropped now (`world.conveyor.part_fates.PartFate`); number of times at
which the fingers began to carry a second part with the one they held; number of the part that both fingers hold off the
belt, from 1 (0: none); and 1 once the arm touched the belt, a tray, table or floor, or one of its links another."""


_SLOTS = {
    REGION_FIELDS: REGION_SLOTS,
    TRACK_FIELDS: TRACK_SLOTS,
    EXPECTED_FIELDS: TRACK_SLOTS,
    PART_FIELDS: PART_SLOTS,
    BELT_FIELDS: PART_SLOTS,
}


def message_size(view: Any) -> int:
    """Returns the number of elements in the vector of a message type."""
    return len(view.get_fields())


def message_rows(message: np.ndarray, fields: tuple[str, ...]) -> np.ndarray:
    """Returns the slots at the end of a message that has slots, such as `Regions`, shape (slots, len(fields)).

    Args:
        message: the vector; a view of it is returned.
        fields: the message's `REGION_FIELDS`, `TRACK_FIELDS`, `EXPECTED_FIELDS`, `PART_FIELDS` or `BELT_FIELDS`.
    """
    slots = _SLOTS[fields]
    return message[len(message) - slots * len(fields) :].reshape(slots, len(fields))


def pack_prediction(stamp: float, seq: int, knots: np.ndarray, spacing: float = KNOT_SPACING) -> np.ndarray:
    """Returns the `Prediction` vector of a valid packet.

    Args:
        stamp: capture time of the newest measurement, which is also the time of the first knot [s].
        seq: sequence number.
        knots: the path, shape (KNOT_COUNT, 5), with the columns `KNOT_FIELDS`.
        spacing: time between two knots [s].
    """
    return np.concatenate([[stamp, seq, stamp, spacing, 1.0], np.ravel(knots)])


def packet_target(seq: float) -> int:
    """Returns the number of the track that a packet is about, 0 from a host that tracks only one object.

    Args:
        seq: sequence number of the packet.
    """
    return int(seq // TARGET_STRIDE)


def prediction_knots(packet: np.ndarray) -> np.ndarray:
    """Returns the knots of a `Prediction` vector, shape (KNOT_COUNT, 5)."""
    return np.asarray(packet)[PREDICTION_HEADER:].reshape(KNOT_COUNT, len(KNOT_FIELDS))


def prediction_end(packet: np.ndarray) -> float:
    """Returns the time [s] of the last knot of a `Prediction` vector: the end of the predicted path."""
    return packet[_FIRST_TIME] + packet[_SPACING] * (KNOT_COUNT - 1)


def evaluate_prediction(packet: np.ndarray, time: float) -> np.ndarray:
    """Returns the predicted (x, y, z, yaw, std) [m, rad] at one time, shape (5,), in W.

    The path is linear between knots. The last interval is extrapolated beyond the last knot, the first interval before
    the first knot.

    Args:
        packet: vector of a valid `Prediction`.
        time: time for which to predict [s].
    """
    packet = np.asarray(packet)
    knots = prediction_knots(packet)
    position = (time - packet[_FIRST_TIME]) / packet[_SPACING]
    index = min(max(int(np.floor(position)), 0), KNOT_COUNT - 2)
    weight = position - index
    return (1.0 - weight) * knots[index] + weight * knots[index + 1]


def predicted_points(packet: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Returns the predicted positions p_WQ of the object [m], shape (n, 3).

    Args:
        packet: vector of a valid `Prediction`.
        times: times for which to predict [s], shape (n,).
    """
    return np.array([evaluate_prediction(packet, time)[:3] for time in times])
