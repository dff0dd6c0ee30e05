"""The vector messages that travel between the rooms.

Every signal but an image is a plain vector port, so that ``LogVectorOutput``, ``DiscreteTimeDelay`` and the link carry
it unchanged. A port that has produced nothing reads all zeros, hence ``valid == 0``. ``stamp`` is always the capture
time [s] of the image the value describes, never the time at which it was computed.
"""

import numpy as np
from pydrake.common.containers import namedview

KNOT_COUNT = 31
"""Knots in a predicted path: 1.5 s at `KNOT_SPACING`."""
KNOT_SPACING = 0.05
"""Time between knots of a predicted path [s]."""
KNOT_FIELDS = ("x", "y", "z", "yaw", "std")
"""Columns of a knot: position in W [m], yaw about W's z axis, continuous along the path [rad], predicted error [m]."""

FrameInfo = namedview("FrameInfo", ["stamp", "fresh"])
"""What a `VideoSource` says of the image it shows: capture time [s], and 0 when none was captured in this cycle."""

Centroid = namedview("Centroid", ["stamp", "u", "v", "pixel_count", "valid"])
"""Motion centroid in one image: stamp [s], u and v [px] (full-frame pixel coordinates, a pixel's centre is whole)."""

TrackPoint = namedview("TrackPoint", ["stamp", "x", "y", "z", "gap", "valid"])
"""A triangulated point: stamp [s], p_WQ = (x, y, z) [m] in W, gap between the two rays [m]."""

Prediction = namedview(
    "Prediction",
    ["stamp", "seq", "first_time", "spacing", "valid"]
    + [f"{field}{k}" for k in range(KNOT_COUNT) for field in KNOT_FIELDS],
)
"""A packet of predicted path: stamp [s] of the newest measurement in it, seq, first_time [s], spacing [s], valid, and
`KNOT_COUNT` knots of `KNOT_FIELDS`. The first knot is the filtered state at ``stamp`` itself."""

PREDICTION_HEADER = 5
"""Fields of a `Prediction` before its first knot."""

ServoTarget = namedview(
    "ServoTarget",
    ["time", "x", "y", "z", "yaw", "vx", "vy", "vz", "yaw_rate", "stamp", "seq", "std", "stale", "valid"],
)
"""What the servo says of the object: its filtered pose and rates at ``time`` [s] (the instant the set-point now being
computed is due), the stamp and seq of the packet it rests on, the packet's own std [m] there, ``stale`` = 1 while
coasting without a fresh packet."""

ArmCommand = namedview("ArmCommand", ["phase", "motion", "duration", "frame", "height", "frozen", "jaw_width"])
"""What the grasp machine asks of the arm: the phase's number, a counter that starts a new straight-line motion when it
changes, that motion's duration [s], the ``frame`` to move in (0 home, 1 with the object, 2 standing where the object
was when the motion began), height of the tool above the object's reference point [m], ``frozen`` = 1 while vision is
not used, jaw opening [m]."""

ToolStatus = namedview("ToolStatus", ["motion", "fraction", "flipping", "x", "y", "z", "yaw", "branch"])
"""Where the commanded tool is: the motion's counter, how much of it is done (0 to 1), ``flipping`` = 1 while the jaws
turn over by 180 deg, commanded p_WT [m] and yaw [rad], the number of half turns by which the jaws are turned."""

JawState = namedview("JawState", ["width", "speed", "force"])
"""What the gripper feels: opening between the pads [m], its rate [m/s], force of the closing drive on each pad [N]."""


def message_size(view):
    """Number of elements in the vector of a message type."""
    return len(view.get_fields())


def pack_prediction(stamp, seq, knots, spacing=KNOT_SPACING):
    """Returns the `Prediction` vector of a valid packet whose first knot is at ``stamp`` [s].

    ``knots`` has shape (KNOT_COUNT, 5) with the columns `KNOT_FIELDS`.
    """
    return np.concatenate([[stamp, seq, stamp, spacing, 1.0], np.ravel(knots)])


def prediction_knots(packet):
    """Returns the knots of a `Prediction` vector, shape (KNOT_COUNT, 5)."""
    return np.asarray(packet)[PREDICTION_HEADER:].reshape(KNOT_COUNT, len(KNOT_FIELDS))


def evaluate_prediction(packet, time):
    """Returns the predicted (x, y, z, yaw, std) at ``time`` [s], linear between knots.

    Beyond the last knot the last interval is extrapolated, before the first knot the first one.
    """
    packet = np.asarray(packet)
    first_time, spacing = packet[2], packet[3]
    knots = prediction_knots(packet)
    position = (time - first_time) / spacing
    index = min(max(int(np.floor(position)), 0), KNOT_COUNT - 2)
    weight = position - index
    return (1.0 - weight) * knots[index] + weight * knots[index + 1]
