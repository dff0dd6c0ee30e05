"""Aligns the images of a camera that moves with the background: a shake, a pan or a knock does not count as motion.

Most cameras stand still. Motion of the camera is looked for only when far more pixels differ from the background than
objects explain.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.camera_motion import (
    CameraMotionDetector,
    CameraMotionState,
    UnusableReason,
    Verdict,
    align,
    edge_tolerance,
)
from drake_tracker.vision.camera_motion_reference import CameraReference
from drake_tracker.vision.config import CameraMotion
from drake_tracker.vision.silhouettes.background_model import Background

KNOWN_SHARE = 0.8
"""Share of the background that must be known before images can be aligned with it."""
UNEXPLAINED_SHARE = 0.01
"""Share of pixels that may differ from the background outside of objects before the camera is checked."""
LEAST_MOTION = 0.5
"""Displacement by which a camera at rest must have moved before its images are aligned [px]: shadows that move shift
the edges of the scene by less."""
DIFFERENT = 12
"""Difference from the background that counts [grey levels]."""
ROWS = 4
"""One row in this many is enough to decide whether the camera is checked."""
REFERENCE_AGE = 300
"""Images after which the reference is prepared again from the background, when it is needed."""
RESIDUAL_SHIFT = 0.25
"""Displacement that is left after the alignment [px]."""
_AROUND, _BESIDE = np.ones((9, 9), np.uint8), np.ones((3, 9), np.uint8)


@dataclass(frozen=True, eq=False)
class Alignment(FrozenState):
    """Memory of the motion of a camera.

    Attributes:
        motion: state of the detector.
        reference: the background as the detector needs it, None until it is needed.
        prepared: number of the image at which it was prepared.
    """

    motion: CameraMotionState
    reference: CameraReference | None = None
    prepared: int = 0


class AlignedImage(NamedTuple):
    """An image as the camera would have seen it without its motion.

    Attributes:
        image: uint8 (h, w, 3).
        missing: uint8 (h, w), 255 where it has no data, or None.
        tolerance: uint8 (h, w), difference from the background that is left by the alignment [grey levels], or None.
        verdict: whether the camera moved.
        displacement: by how much [px].
        reason: why it is unusable.
    """

    image: np.ndarray
    missing: np.ndarray | None
    tolerance: np.ndarray | None
    verdict: Verdict
    displacement: float
    reason: UnusableReason = UnusableReason.NONE


class ImageAlignment:
    """Aligns images with the background of a `BackgroundModel`. All state is with the caller.

    Args:
        settings: `CameraMotion`.

    Raises DrakeTrackerError on a value outside its range.
    """

    def __init__(self, settings: CameraMotion = CameraMotion()) -> None:
        self._detector = CameraMotionDetector(settings)

    def start(self) -> Alignment:
        """Returns the state before the first image."""
        return Alignment(self._detector.initial_state())

    def update(
        self,
        state: Alignment,
        background: Background,
        image: np.ndarray,
        difference: np.ndarray,
        hidden: np.ndarray | None = None,
    ) -> tuple[Alignment, AlignedImage]:
        """Returns the state after an image, and the image aligned with the background.

        Args:
            state: the state before.
            background: the background and the silhouettes of the previous image.
            image: smoothed, uint8 (h, w, 3).
            difference: from the background, uint8 (h, w), as from `BackgroundModel.difference`.
            hidden: uint8 (h, w), 255 where the robot's own arm is, or None.
        """
        same = AlignedImage(image, None, None, Verdict.STILL, 0.0)
        moved = state.motion.steady > 0 or state.motion.unusable > 0
        if not moved and not suggests_motion(background, difference, hidden):
            return state, same
        if state.reference is None or background.count - state.prepared > REFERENCE_AGE:
            grey = cv2.cvtColor(background.picture, cv2.COLOR_RGB2GRAY)
            state = replace(state, reference=self._detector.reference(grey), prepared=background.count)
        assert state.reference is not None
        ignored = cv2.dilate(background.mask if hidden is None else cv2.bitwise_or(background.mask, hidden), _AROUND)
        found, motion = self._detector.observe(
            state.motion, cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), state.reference, ignored
        )
        if not moved and found.verdict is Verdict.COMPENSATED and found.displacement < LEAST_MOTION:
            return state, same
        state = replace(state, motion=motion)
        if found.verdict in (Verdict.STILL, Verdict.UNUSABLE) or found.transform is None:
            return state, same._replace(verdict=found.verdict, displacement=found.displacement, reason=found.reason)
        channels = [align(channel, found.transform)[0] for channel in cv2.split(image)]
        grey = cv2.cvtColor(background.picture, cv2.COLOR_RGB2GRAY)
        tolerance = cv2.convertScaleAbs(edge_tolerance(grey, RESIDUAL_SHIFT))
        aligned = read_only(cv2.merge(channels))
        return state, AlignedImage(aligned, found.missing, tolerance, found.verdict, found.displacement)


def suggests_motion(background: Background, difference: np.ndarray, hidden: np.ndarray | None) -> bool:
    """Returns whether more of an image differs from the background than objects explain.

    Args:
        background: the background and the silhouettes of the previous image.
        difference: of the image from the background, uint8 (h, w), as from `BackgroundModel.difference`.
        hidden: uint8 (h, w), 255 where the robot's own arm is, or None.
    """
    known = background.known[::ROWS]
    if cv2.countNonZero(known) < KNOWN_SHARE * known.size:
        return False
    differs = cv2.threshold(difference[::ROWS], max(DIFFERENT, 6.0 * background.noise), 255, cv2.THRESH_BINARY)[1]
    if hidden is not None:
        differs = cv2.subtract(differs, hidden[::ROWS])
    objects = cv2.dilate(background.mask[::ROWS], _BESIDE)
    unexplained = cv2.countNonZero(cv2.subtract(cv2.bitwise_and(differs, known), objects))
    return unexplained > UNEXPLAINED_SHARE * known.size
