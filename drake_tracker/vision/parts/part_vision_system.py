"""The parts on a belt in the images of two cameras, as a Drake System."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.belt_frame import BeltFrame
from drake_tracker.core.constants import SIDES
from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import (
    PART_FIELDS,
    PART_SLOTS,
    REGION_FIELDS,
    REGION_SLOTS,
    TRACK_FIELDS,
    TRACK_SLOTS,
    Centroid,
    PartTracks,
    Regions,
    TrackPoints,
    TrackState,
    message_rows,
    message_size,
)
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.core.timing import VISION_PERIOD, capture_time
from drake_tracker.vision.detection_mask import DetectionMask
from drake_tracker.vision.parts.belt_surface import BeltLook, BeltSurface
from drake_tracker.vision.parts.part_silhouette import PartSilhouette
from drake_tracker.vision.parts.part_track import PartTrack
from drake_tracker.vision.parts.part_tracker import PartImage, PartTracker, PartTrackerState


@dataclass(frozen=True, eq=False)
class PartVisionMemory(FrozenState):
    """State of a `PartVisionSystem`.

    Attributes:
        looks: memory of the images of each camera, empty before the first image.
        tracker: state of the tracker.
        messages: the vectors of the output ports, in their order; none before the first images.
    """

    looks: tuple[BeltLook, ...] = ()
    tracker: PartTrackerState = PartTrackerState()
    messages: tuple[np.ndarray, ...] = ()


class PartVisionSystem(LeafSystem):
    """Finds and tracks the parts on a belt.

    .. pydrake_system::

        name: PartVisionSystem
        input_ports:
        - camera_left
        - camera_right
        - hidden_left
        - hidden_right
        output_ports:
        - parts
        - tracks
        - regions_left
        - regions_right
        - centroid_left
        - centroid_right
        - motion_left
        - motion_right

    ``camera_*`` are `ImageRgba8U`, read at offset 0 in an unrestricted update when they show the images of a cycle
    whose number is a multiple of ``update_cycles``. ``hidden_*`` is the silhouette of the robot's own arm in the image,
    a uint8 array of the image's shape or None; both may stay unconnected. ``parts`` is a `PartTracks` of the newest
    images, without any lag. The other outputs serve pictures and video: ``tracks``, a `TrackPoints`; ``regions_*``,
    `Regions` with a rectangle around each part that is seen; ``centroid_*``, a `Centroid` with the stamp only; and
    ``motion_*``, the foreground as a `DetectionMask`. All vectors are zeros before the first images.

    Args:
        surfaces: {side: `BeltSurface`}.
        tracker: `PartTracker`, with cameras in the order of `SIDES`.
        image_windows: {side: part of the full image that the images show (u0, v0, width, height) [px]}.
        belts: {side: uint8 (h, w), not 0 where the image shows the belt}.
        belt_height: z_W of the belt's upper face [m].
        reach: smallest and largest y of the parts that are reported [m].
        period: of a cycle [s].
        update_cycles: cycles from one pair of images that is looked at to the next.
        image_latency: cycles from the capture of an image until the input shows it.
    """

    def __init__(
        self,
        surfaces: Mapping[str, BeltSurface],
        tracker: PartTracker,
        *,
        image_windows: Mapping[str, tuple[int, int, int, int]],
        belts: Mapping[str, np.ndarray],
        belt_height: float,
        reach: tuple[float, float],
        frame: BeltFrame = BeltFrame(),
        period: float = VISION_PERIOD,
        update_cycles: int = 1,
        image_latency: int = 0,
    ) -> None:
        super().__init__()
        self._surfaces, self._tracker = [surfaces[side] for side in SIDES], tracker
        self._beyond = [cv2.bitwise_not(np.where(belts[side] > 0, np.uint8(255), np.uint8(0))) for side in SIDES]
        self._offsets = [image_windows[side][:2] for side in SIDES]
        self._belt_height, self._reach = belt_height, reach
        self._period, self._update_cycles, self._latency = period, update_cycles, image_latency
        self._images = [
            self.DeclareAbstractInputPort(f"camera_{side}", AbstractValue.Make(ImageRgba8U())) for side in SIDES
        ]
        self._hidden = [self.DeclareAbstractInputPort(f"hidden_{side}", AbstractValue.Make(object())) for side in SIDES]
        state = self.DeclareAbstractState(AbstractValue.Make(PartVisionMemory()))
        ticket = {self.abstract_state_ticket(state)}

        self._packers: list[Callable[[PartTrackerState], np.ndarray]] = []

        def declare(name: str, view: Any, pack: Callable[[PartTrackerState], np.ndarray]) -> None:
            index = len(self._packers)
            self._packers.append(pack)
            blank = np.zeros(message_size(view))
            declare_outputs(
                self, state, {name: (view, lambda memory: memory.messages[index] if memory.messages else blank)}
            )

        declare(
            "parts", PartTracks, lambda tracks: pack_parts(tracks.stamp, self._reported(tracks), belt_height, frame)
        )
        declare(
            "tracks",
            TrackPoints,
            lambda tracks: pack_part_tracks(tracks.stamp, self._reported(tracks), belt_height, tracks.speed, frame),
        )
        for k, side in enumerate(SIDES):
            declare(f"regions_{side}", Regions, partial(self._regions, k))
            declare(f"centroid_{side}", Centroid, lambda tracks: np.array([tracks.stamp, 0.0, 0.0, 0.0, 0.0]))

            def calc_motion(context: Context, output: AbstractValue, k: int = k) -> None:
                output.set_value(self._motion(context, k))

            self.DeclareAbstractOutputPort(
                f"motion_{side}", lambda k=k: AbstractValue.Make(self._no_motion(k)), calc_motion, ticket
            )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _memory(self, context: Context) -> PartVisionMemory:
        memory: PartVisionMemory = context.get_abstract_state(0).get_value()
        return memory

    def _reported(self, tracks: PartTrackerState) -> list[PartTrack]:
        return reported(tracks, *self._reach)

    def _regions(self, k: int, tracks: PartTrackerState) -> np.ndarray:
        return pack_part_regions(tracks.stamp, self._reported(tracks), self._tracker.silhouettes[k], self._offsets[k])

    def _update(self, context: Context, state: State) -> None:
        stamp = capture_time(context.get_time(), self._latency, self._period)
        cycle = round(stamp / self._period)
        if cycle < 0 or cycle % self._update_cycles:
            return
        memory = self._memory(context)
        images = [port.Eval(context).data[:, :, :3] for port in self._images]
        looks = memory.looks or tuple(each.start(image) for each, image in zip(self._surfaces, images))
        hidden = [port.Eval(context) if port.HasValue(context) else None for port in self._hidden]
        looks = tuple(
            surface.update(look, image, covered)
            for surface, look, image, covered in zip(self._surfaces, looks, images, hidden)
        )
        seen = []
        for look, beyond, covered in zip(looks, self._beyond, hidden):
            unseen = cv2.bitwise_or(beyond, look.doubtful)
            seen.append(PartImage(look.mask, unseen if covered is None else cv2.bitwise_or(unseen, covered)))
        tracker = self._tracker.update(memory.tracker, stamp, seen)
        messages = tuple(read_only(pack(tracker)) for pack in self._packers)
        state.get_mutable_abstract_state(0).set_value(PartVisionMemory(looks, tracker, messages))

    def _motion(self, context: Context, k: int) -> DetectionMask:
        memory = self._memory(context)
        if not memory.looks:
            return self._no_motion(k)
        return DetectionMask(memory.tracker.stamp, memory.looks[k].mask, self._offsets[k])

    def _no_motion(self, k: int) -> DetectionMask:
        return DetectionMask(0.0, read_only(np.zeros((1, 1), np.uint8)), self._offsets[k])


def reported(state: PartTrackerState, first: float, last: float) -> list[PartTrack]:
    """Returns the confirmed parts between two places along the belt, those farthest downstream first.

    Args:
        state: of the tracker.
        first: smallest y [m].
        last: largest y [m].
    """
    tracks = [track for track in state.tracks if track.number > 0 and first <= track.pose.y <= last]
    return sorted(tracks, key=lambda track: -track.pose.y)


def pack_parts(
    stamp: float, tracks: Sequence[PartTrack], belt_height: float, frame: BeltFrame = BeltFrame()
) -> np.ndarray:
    """Returns the `PartTracks` vector of parts; of the first parts, if there are more parts than slots.

    Args:
        stamp: of the images [s].
        tracks: the parts.
        belt_height: z of the belt's upper face, in the frame of the belt [m].
        frame: of the belt, in which the parts were found.
    """
    message = np.zeros(message_size(PartTracks))
    header = PartTracks(message)
    header.stamp, header.valid = stamp, 1.0
    for row, track in zip(message_rows(message, PART_FIELDS), tracks[:PART_SLOTS]):
        pose, variances = track.pose, np.diag(track.fit.covariance)
        z = belt_height + 0.5 * PART_SHAPES[pose.kind].height
        ((x, y, z, yaw),) = frame.to_world(np.array([[pose.x, pose.y, z, pose.yaw]]))
        row[:] = [
            *(track.number, pose.kind, x, y, z, yaw),
            *(variances[1], variances[0], variances[2], track.seen),
        ]
    return message


def pack_part_tracks(
    stamp: float, tracks: Sequence[PartTrack], belt_height: float, speed: float, frame: BeltFrame = BeltFrame()
) -> np.ndarray:
    """Returns the `TrackPoints` vector that shows parts in a video.

    Args:
        stamp: of the images [s].
        tracks: the parts.
        belt_height: z of the belt's upper face, in the frame of the belt [m].
        speed: of the belt [m/s].
        frame: of the belt, in which the parts were found.
    """
    message = np.zeros(message_size(TrackPoints))
    header = TrackPoints(message)
    header.stamp, header.valid, header.overflow = stamp, 1.0, max(len(tracks) - TRACK_SLOTS, 0)
    for row, track in zip(message_rows(message, TRACK_FIELDS), tracks):
        shape, pose = PART_SHAPES[track.pose.kind], track.pose
        state = TrackState.MOVING if track.seen >= stamp else TrackState.NOT_OBSERVED
        place = np.array([[pose.x, pose.y, belt_height + 0.5 * shape.height, 0.0]])
        ((x, y, z, _),) = frame.to_world(place).tolist()
        values = {
            "number": track.number, "state": state, "x": x, "y": y, "z": z,
            "vy": speed, "seen": track.seen, "size": shape.length,
        }  # fmt: skip
        row[:] = [values.get(field, 0.0) for field in TRACK_FIELDS]
    return message


def pack_part_regions(
    stamp: float, tracks: Sequence[PartTrack], silhouette: PartSilhouette, offset: tuple[int, int]
) -> np.ndarray:
    """Returns the `Regions` vector with the upright rectangle around each part that is seen in an image.

    Args:
        stamp: of the image [s].
        tracks: the parts.
        silhouette: draws them in the image.
        offset: (u0, v0) of the first pixel of the image in the full image [px].
    """
    message = np.zeros(message_size(Regions))
    seen = [track for track in tracks if track.seen >= stamp]
    header = Regions(message)
    header.stamp, header.count, header.usable = stamp, len(seen), 1.0
    for row, track in zip(message_rows(message, REGION_FIELDS), seen[:REGION_SLOTS]):
        corners = np.concatenate(silhouette.outlines(track.pose)) + offset
        (u, v), (width, height) = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)
        values = {"u": u, "v": v, "width": width, "height": height, "share": track.fit.share, "track": track.number}
        row[:] = [values.get(field, 0.0) for field in REGION_FIELDS]
    return message
