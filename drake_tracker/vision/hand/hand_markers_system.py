"""The robot's own hand in the images of two cameras, as a Drake System."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.arm.marker_kinematics import MarkerKinematics
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import HandPoint, JawState, message_size
from drake_tracker.core.timing import VISION_PERIOD, capture_time
from drake_tracker.vision.hand.hand_markers import (
    FoundMarkers,
    HandDisplacement,
    HandMarkerFinder,
    MarkerSearch,
    triangulate_hand,
    with_image,
)


@dataclass(frozen=True, eq=False)
class _Memory(FrozenState):
    """The state of a `HandMarkersSystem`.

    Attributes:
        seq: number of images looked at.
        line: the newest `HandPoint` vectors, oldest first.
        displacements: of the hand in the images of the left and the right camera.
    """

    seq: int
    line: tuple[np.ndarray, ...]
    displacements: tuple[HandDisplacement, ...]


class HandMarkersSystem(LeafSystem):
    """Finds the markers of the hand in each pair of images, and passes the tool point on after the lag of the pipeline.

    .. pydrake_system::

        name: HandMarkersSystem
        input_ports:
        - camera_left
        - camera_right
        - arm_state
        - jaws
        output_ports:
        - hand_point
        - displacement_left
        - displacement_right

    ``camera_*`` are `ImageRgba8U`, read every ``period`` at offset 0 in an unrestricted update. ``arm_state`` is (q, v)
    [rad, rad/s] at the capture of these images, and ``jaws`` a `JawState`. ``hand_point`` is the `HandPoint` of some
    cycles ago, all zeros when the hand was not seen. ``displacement_*`` is by how much the hand is displaced to the
    right and downwards in the images up to the newest one, shape (2,) [px], zeros while it is not known.

    Args:
        kinematics: of the hand's markers.
        cameras: {"left": `CameraModel`, "right": `CameraModel`}, calibrated.
        windows: the same keys, rectangle (u0, v0, width, height) [px] of the full frame that the images cover.
        height: z_W of the objects whose positions are to be corrected [m].
        num_joints: number n of the arm's joints.
        search: where to search for markers, and what to accept.
        keep: time for which the displacements are kept after the last image with markers [s].
        delay_cycles: cycles from the update with an image to the output of its `HandPoint`.
        period: of a cycle [s].
        image_latency: cycles from the capture of an image until the input shows it, as with a `PipelinedCamera`.
        update_cycles: cycles from one pair of images that is looked at to the next; ``hand_point`` keeps its value.
    """

    def __init__(
        self,
        kinematics: MarkerKinematics,
        cameras: Mapping[str, CameraModel],
        windows: Mapping[str, tuple[int, int, int, int]],
        height: float,
        num_joints: int,
        search: MarkerSearch = MarkerSearch(),
        *,
        keep: float = 3.0,
        delay_cycles: int = 0,
        period: float = VISION_PERIOD,
        image_latency: int = 0,
        update_cycles: int = 1,
    ) -> None:
        super().__init__()
        self._kinematics, self._search, self._num_joints, self._height = kinematics, search, num_joints, height
        self._finders = [HandMarkerFinder(cameras[side], windows[side], search) for side in SIDES]
        self._length, self._period, self._latency = delay_cycles + 1, period, image_latency
        self._update_cycles = update_cycles
        self._kept_images = round(keep / period / update_cycles)
        self._images = [
            self.DeclareAbstractInputPort(f"camera_{side}", AbstractValue.Make(ImageRgba8U())) for side in SIDES
        ]
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * num_joints)
        self._jaws = self.DeclareVectorInputPort("jaws", message_size(JawState))
        self._nothing = read_only(np.zeros(message_size(HandPoint)))
        self._memory = self.DeclareAbstractState(AbstractValue.Make(_Memory(0, (), (HandDisplacement(),) * 2)))
        displacements = {
            f"displacement_{side}": (2, lambda memory, k=k: memory.displacements[k].median)
            for k, side in enumerate(SIDES)
        }
        declare_outputs(self, self._memory, {"hand_point": (HandPoint, self._delayed), **displacements})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        time = capture_time(context.get_time(), self._latency, self._period)
        cycle = round(time / self._period)
        if cycle < 0:
            return
        memory = context.get_abstract_state(self._memory).get_value()
        if cycle % self._update_cycles:
            line = (*memory.line, memory.line[-1])[-self._length :]
            state.get_mutable_abstract_state(self._memory).set_value(replace(memory, line=line))
            return
        q = self._arm_state.Eval(context)[: self._num_joints]
        places = self._kinematics.places(q, JawState(self._jaws.Eval(context)).width)
        found = [
            finder.find(cv2.cvtColor(image.Eval(context).data, cv2.COLOR_RGBA2GRAY), places.p_WM, places.up_W)
            for finder, image in zip(self._finders, self._images)
        ]
        seq = memory.seq + 1
        line = (*memory.line, self._hand_point(found, places.p_WT, time, seq))[-self._length :]
        displacements = tuple(
            with_image(before, each, self._kept_images) for before, each in zip(memory.displacements, found)
        )
        state.get_mutable_abstract_state(self._memory).set_value(_Memory(seq, line, displacements))

    def _hand_point(self, found: Sequence[FoundMarkers | None], p_WT: np.ndarray, stamp: float, seq: int) -> np.ndarray:
        """Returns the `HandPoint` vector of a pair of images, all zeros when they do not show the hand.

        Args:
            found: the markers in the left and the right image.
            p_WT: the predicted tool point, shape (3,) [m].
            stamp: capture time [s].
            seq: number of the pair.
        """
        cameras = [finder.camera for finder in self._finders]
        hand = triangulate_hand(cameras, found, p_WT, self._height, self._search.max_gap)
        if hand is None:
            return self._nothing
        return read_only(np.array([stamp, seq, *hand.p_WT, hand.gap, hand.markers, 1.0]))

    def _delayed(self, memory: _Memory) -> np.ndarray:
        return memory.line[0] if len(memory.line) == self._length else self._nothing
