"""The knowledge at the last instants before the contact of jaws and train: the results of vision in the images of these
instants, the expected place of the contact, and the hand.

Everything except the instant of the contact is from signals of the loop. Pixel coordinates are those of the full image.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.messages import REGION_FIELDS, evaluate_prediction, message_rows
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.episode import Log, PhaseSpan, can_be_evaluated, interpolate_rows, tool_pose
from drake_tracker.tasks.filming import Frame
from drake_tracker.tasks.tracks import TRACKS, TrackRow, track_rows
from drake_tracker.tasks.train.closing import Contact

COUNT = 6
"""Number of instants."""
SPAN = 0.5
"""Time from the first instant to the contact [s]."""
_NEAR = 0.03
"""Largest time between a frame and the instant for which it is shown [s]."""
_NOWHERE = np.full(2, np.nan)
_NOWHERE.flags.writeable = False


@dataclass(frozen=True, eq=False)
class InstantView:
    """The image of one camera at an instant, and the places of the known things in this image.

    Attributes:
        image: the image, BGR uint8 of shape (height, width, 3).
        offset: (u0, v0) of its first pixel [px].
        outline: corners of the rectangle around the region that vision found of the target in this image [px],
            shape (4, 2), or (0, 2) if it found none.
        point: position of the target that vision reported for this image [px], shape (2,), NaN without a report.
        contact: where the object will be at the contact according to the packet that the arm followed [px], shape (2,),
            NaN without a packet.
        jaws: middles of the two pads according to the joints [px], shape (2, 2).
    """

    image: np.ndarray
    offset: tuple[int, int]
    outline: np.ndarray
    point: np.ndarray
    contact: np.ndarray
    jaws: np.ndarray


@dataclass(frozen=True, eq=False)
class GraspInstant:
    """An instant before the contact.

    Attributes:
        time: of the images [s].
        before: time from the images to the contact [s].
        phase: of the hand.
        seen: whether vision measured the target in these images; otherwise its position is a prediction.
        age: age of the newest measurement on which the packet rests that the arm followed [s], NaN without a packet.
        sights: {side: what its camera saw}.
    """

    time: float
    before: float
    phase: IntEnum
    seen: bool
    age: float
    sights: Mapping[str, InstantView]


def grasp_instants(
    contact: Contact,
    spans: Sequence[PhaseSpan],
    log: Log,
    frames: Sequence[Frame],
    cameras: Mapping[str, CameraModel],
    offsets: Mapping[str, tuple[int, int]],
) -> list[GraspInstant]:
    """Returns the instants before a contact in the order of time, as far as frames were kept.

    Args:
        contact: when it was.
        spans: phases of the run.
        log: {name: Signal} of the run.
        frames: images around the last closing, in the order of time.
        cameras: {side: calibrated camera}.
        offsets: {side: (u0, v0) of the first pixel of its images in the full image [px]}.
    """
    instants = []
    for frame in choose_frames(frames, contact.time):
        packet = packet_followed(log, frame.time)
        p_WQ = np.full((1, 3), np.nan) if packet is None else evaluate_prediction(packet, contact.time)[None, :3]
        pads = pad_positions(log, frame.time)
        target = reported_target(log, frame.time)
        sights, measured = {}, []
        for side, image in frame.images.items():
            camera = cameras[side]
            outline = reported_outline(log, side, frame.time, target.number) if target is not None else np.zeros((0, 2))
            point = _project(camera, target.p_WQ[None])[0] if target is not None else centroid(log, side, frame.time)
            (at,) = _project(camera, p_WQ)
            sights[side] = InstantView(image, offsets[side], outline, point, at, _project(camera, pads))
            measured.append(np.isfinite(point).all() and (target is None or target.seen))
        instants.append(
            GraspInstant(
                time=frame.time,
                before=contact.time - frame.time,
                phase=[span.phase for span in spans if span.start <= frame.time][-1],
                seen=all(measured),
                age=np.nan if packet is None else frame.time - float(packet[0]),
                sights=sights,
            )
        )
    return instants


def choose_frames(frames: Sequence[Frame], contact: float) -> list[Frame]:
    """Returns the frames nearest to `COUNT` instants that are evenly spaced over the `SPAN` up to the contact.

    An instant for which no frame was kept is left out.

    Args:
        frames: frames in the order of time.
        contact: time of the contact [s].
    """
    wanted = np.linspace(contact - SPAN, contact, COUNT)
    nearest = [min(frames, key=lambda frame: abs(frame.time - time), default=None) for time in wanted]
    return [frame for frame, time in zip(nearest, wanted) if frame is not None and abs(frame.time - time) <= _NEAR]


def packet_followed(log: Log, time: float) -> np.ndarray | None:
    """Returns the `Prediction` vector on which the servo's target rested at a time [s], None without one.

    Args:
        log: {name: Signal} of the run.
        time: the time [s].
    """
    target, delivered = log["target"], log["delivered"]
    newest = np.searchsorted(target.times, time, side="right") - 1
    if newest < 0 or not target["valid"][newest] > 0:
        return None
    rows = np.nonzero(can_be_evaluated(delivered) & (delivered["seq"] == target["seq"][newest]))[0]
    return delivered.data[rows[0]] if len(rows) else None


def pad_positions(log: Log, time: float) -> np.ndarray:
    """Returns the middles of the two pads in W at a time [s], shape (2, 3) [m], NaN where nothing is logged.

    They follow from the measured joints by forward kinematics, and from the measured opening of the jaws.

    Args:
        log: {name: Signal} of the run.
        time: the time [s].
    """
    ((x, y, z, yaw),) = tool_pose(log, [time])
    jaws = log["jaws"]
    ((width,),) = interpolate_rows(np.array([time]), jaws.times, jaws.view("width"))
    half = 0.5 * width * np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    return np.array([x, y, z]) + np.array([half, -half])


def reported_target(log: Log, time: float) -> TrackRow | None:
    """Returns the target that vision reported for the images of a time [s], None without a report or a target.

    Args:
        log: {name: Signal} of the run.
        time: capture time of the images [s].
    """
    message = _about(log, TRACKS, time)
    rows = [] if message is None else track_rows(message)
    return next((row for row in rows if row.target), None)


def reported_outline(log: Log, side: str, time: float, number: int) -> np.ndarray:
    """Returns the corners of the rectangle around the region of a track in one image [px], shape (4, 2).

    The shape is (0, 2) where vision found no such region.

    Args:
        log: {name: Signal} of the run.
        side: of the camera.
        time: capture time of the image [s].
        number: of the track.
    """
    message = _about(log, f"regions_{side}", time)
    fields = ("u", "v", "width", "height", "track")
    for row in () if message is None else message_rows(message, REGION_FIELDS):
        u, v, width, height, track = (row[REGION_FIELDS.index(name)] for name in fields)
        if track == number and width > 0.0:
            corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
            return np.array([u, v]) + corners * [width, height]
    return np.zeros((0, 2))


def centroid(log: Log, side: str, time: float) -> np.ndarray:
    """Returns the centroid that vision found in one image [px], shape (2,), NaN where it found none.

    Args:
        log: {name: Signal} of the run.
        side: of the camera.
        time: capture time of the image [s].
    """
    name = f"centroid_{side}"
    message = None if TRACKS in log else _about(log, name, time)
    return _NOWHERE if message is None else message[[log[name].names.index(field) for field in ("u", "v")]]


def _about(log: Log, name: str, time: float) -> np.ndarray | None:
    """Returns the vector of a signal whose stamp is a given time [s], None without one that is valid."""
    signal = log.get(name)
    if signal is None or len(signal.times) == 0:
        return None
    valid = signal["usable" if "usable" in signal.names else "valid"] > 0
    rows = np.nonzero(valid & (np.abs(signal["stamp"] - time) < 0.5 * VISION_PERIOD))[0]
    return signal.data[rows[-1]] if len(rows) else None


def _project(camera: CameraModel, p_WQ: np.ndarray) -> np.ndarray:
    """Returns the pixels (n, 2) of points (n, 3) [m], NaN for a point that is not finite."""
    return np.where(np.isfinite(p_WQ).all(axis=1, keepdims=True), camera.project(np.nan_to_num(p_WQ)), np.nan)
