"""The parts on a belt in the images of two cameras, as a Drake System."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.constants import SIDES
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import Centroid, PartTracks, Regions, TrackPoints, message_size
from drake_tracker.core.timing import VISION_PERIOD, capture_time
from drake_tracker.vision.centroid.motion_centroid_system import DetectionMask
from drake_tracker.vision.parts.belt_surface import BeltLook, BeltSurface
from drake_tracker.vision.parts.part_messages import pack_part_regions, pack_part_tracks, pack_parts, reported
from drake_tracker.vision.parts.part_track import PartTrack
from drake_tracker.vision.parts.part_tracker import PartImage, PartTracker, PartTrackerState


@dataclass(frozen=True, eq=False)
class PartVisionMemory(FrozenState):
    """State of a `PartVisionSystem`.

    Attributes:
        looks: what is remembered of the images of each camera, empty before the first one.
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
    whose number is a multiple of ``update_cycles``. ``hidden_*`` is the
    silhouette of the robot's own arm in the image, a uint8 array of the image's shape or None; both may stay
    unconnected. ``parts`` is a `PartTracks` of the newest images, without any lag. The other outputs serve pictures
    and video: ``tracks``, a `TrackPoints`; ``regions_*``, `Regions` with a rectangle around each part that is seen;
    ``centroid_*``, a `Centroid` with the stamp only; and ``motion_*``, what stands out from the belt, as a
    `DetectionMask`. All vectors are zeros before the first images.

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

            def calc(context: Context, output: BasicVector) -> None:
                messages = self._memory(context).messages
                output.SetFromVector(messages[index] if messages else np.zeros(message_size(view)))

            self.DeclareVectorOutputPort(name, message_size(view), calc, ticket)

        declare("parts", PartTracks, lambda tracks: pack_parts(tracks.stamp, self._reported(tracks), belt_height))
        declare(
            "tracks",
            TrackPoints,
            lambda tracks: pack_part_tracks(tracks.stamp, self._reported(tracks), belt_height, tracks.speed),
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
