"""Motion of the camera itself: a shake, a pan, a knock.

Whatever compares images of a fixed camera takes motion of the camera for motion of the scene. `CameraMotionDetector`
compares each image with a reference image of the static scene. It says whether the camera stands still, aligns the
image with the reference when it does not, and rejects images that cannot be aligned.

Transforms are homogeneous matrices (3, 3) of pixel coordinates (u, v). A homography is exact when a pinhole camera
turns about its centre, and approximate when the camera is moved. Edges of large images are compared at a lower
resolution. Settings in pixels refer to that resolution; results are in pixels of the image itself.
"""

from dataclasses import dataclass, field, replace
from enum import Enum

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.camera_motion_fit import NEAR, WIDE, Fit, check_still, fit, nearest_shift
from drake_tracker.vision.camera_motion_reference import CameraReference, prepare_image, prepare_reference
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.config import CameraMotion
from drake_tracker.vision.light_gain import light_gain

SURE, POSSIBLE = 0.8, 0.6
"""Agreement of the edges with which a fit is accepted at once, and with which the best of several fits is accepted."""
LARGEST_SCATTER = 0.8
"""Scatter of the contrasts above which a fit that moves the image may be an accident. In rendered and synthetic images
it was up to 0.5 for right fits with sensor noise of 10 grey levels, and 1.1 and more for images of another scene."""
STILL_STDS = 4.0
"""A displacement within this many standard deviations of its expected error does not count as motion."""


LEAST_SIDE = 16
"""Least height and width of an image [px]."""
IDENTITY = read_only(np.eye(3))
"""The transform that moves nothing."""


class Verdict(Enum):
    """Usability of an image."""

    STILL = "still"
    """The camera has not moved; the image is used as it is."""
    COMPENSATED = "compensated"
    """The camera has moved, and the image was aligned with the reference."""
    DISPLACED = "displaced"
    """As `COMPENSATED`, and the camera has stayed at the new place for some time: it was knocked."""
    UNUSABLE = "unusable"
    """The image cannot be aligned, so that nothing may be concluded from it."""


class UnusableReason(Enum):
    """Why an image is unusable."""

    NONE = ""
    LIGHT = "light"
    """The brightness of the whole image changed too much."""
    MISMATCH = "mismatch"
    """The edges of the reference are not found: the camera moved too far or too fast, is blurred, or is covered."""
    OVERLAP = "overlap"
    """Too little of the reference is still in the image."""
    PRECISION = "precision"
    """The image has too little texture or too much noise for a fit of the required precision."""


@dataclass(frozen=True)
class CameraMotionState(FrozenState):
    """Memory from image to image; all arrays are read-only.

    Attributes:
        warp: (3, 3) transform of the newest fit, from the reference to the image, at the resolution of the fit.
        anchor: (3, 3) warp of the image since which the camera stays displaced.
        steady: number of consecutive images in which the camera stayed at its new place; 0 when it is not displaced.
        unusable: number of unusable images in a row.
    """

    warp: np.ndarray = field(default_factory=lambda: IDENTITY)
    anchor: np.ndarray = field(default_factory=lambda: IDENTITY)
    steady: int = 0
    unusable: int = 0


@dataclass(frozen=True)
class CameraObservation:
    """Findings about an image.

    Attributes:
        verdict: its usability.
        reason: why it is unusable.
        image: uint8 (h, w), aligned with the reference; the given image itself unless the verdict is compensated or
            displaced.
        missing: uint8 (h, w), 255 where ``image`` has no data because the camera does not see the place; None when
            nothing is missing.
        transform: (3, 3) from pixels of the given image to those of the reference, the identity when the camera is
            still; None when the image is unusable.
        displacement: root mean square displacement of the reference's edges [px].
        std: expected error of the displacement [px]. It is infinite when the fit did not converge, and when the
            reference has no texture, or none outside of the mask: motion of the camera can then be neither seen nor
            mistaken for motion of the scene, and the verdict is still.
    """

    verdict: Verdict
    reason: UnusableReason
    image: np.ndarray
    missing: np.ndarray | None
    transform: np.ndarray | None
    displacement: float
    std: float


class CameraMotionDetector:
    """Detects and compensates motion of the camera. It holds no state, so that Contexts may share it.

    Args:
        settings: the thresholds.

    Raises DrakeTrackerError on a value outside its range.
    """

    def __init__(self, settings: CameraMotion = CameraMotion()) -> None:
        check_settings(settings, "camera motion")
        self.settings = settings

    def reference(self, image: np.ndarray) -> CameraReference:
        """Returns the features of a reference image for `observe`, grey uint8 (h, w): the background, or an earlier
        image.

        It takes some milliseconds. A background that changes slowly need not be prepared again for each image.
        """
        return prepare_reference(_grey(image, "the reference"), self.settings.largest_side)

    def initial_state(self) -> CameraMotionState:
        """Returns the state before the first image."""
        return CameraMotionState()

    def observe(
        self,
        state: CameraMotionState,
        image: np.ndarray,
        reference: CameraReference,
        mask: np.ndarray | None = None,
    ) -> tuple[CameraObservation, CameraMotionState]:
        """Returns (findings about an image, the next state).

        Args:
            state: from the previous image.
            image: grey uint8 (h, w), not changed.
            reference: from `reference`, of the same size.
            mask: uint8 (h, w), not 0 at pixels of the reference that must not be used, such as objects that stood
                there in the previous image; None to use all.

        Raises DrakeTrackerError when image or mask are not uint8 arrays of the size of the reference.
        """
        for array, name in ((image, "the image"), (mask, "the mask")):
            if array is not None and _grey(array, name).shape[::-1] != reference.size:
                own, size = (f"{width} x {height} px" for width, height in (array.shape[::-1], reference.size))
                raise DrakeTrackerError(f"camera motion: {name} has {own}, the reference has {size}")
        if mask is not None:
            reference = reference.without(mask)
        small = prepare_image(image, reference.factor)
        found = self._fit(small, state, reference)
        reason = self._reason(found, small, reference, state)
        if reason is not UnusableReason.NONE:
            observation = _observation(Verdict.UNUSABLE, image, found, reference, reason)
            return observation, replace(state, unusable=state.unusable + 1)
        if self._is_still(found) or not reference.textured:
            return _observation(Verdict.STILL, image, found, reference), CameraMotionState()
        stays = state.steady > 0 and reference.distance(found.warp, state.anchor) < self.settings.steadiness
        steady, warp = state.steady + 1 if stays else 1, read_only(found.warp)
        verdict = Verdict.DISPLACED if steady > self.settings.steady_images else Verdict.COMPENSATED
        state = CameraMotionState(warp, state.anchor if stays else warp, steady)
        return _observation(verdict, image, found, reference), state

    def _fit(self, image: np.ndarray, state: CameraMotionState, reference: CameraReference) -> Fit:
        """Returns the best fit of a prepared image; more expensive fits are tried only when needed."""
        if not reference.textured or state.steady == state.unusable == 0:
            check, still = check_still(image, reference), self.settings.still
            sure = check.agreement >= SURE and check.std < still and check.displacement < still
            if sure or not reference.textured:
                return check
        best = fit(image, reference, nearest_shift(image, reference, state.warp, NEAR))
        if best.agreement < SURE or np.isinf(best.std):
            shift = nearest_shift(image, reference, IDENTITY, WIDE)
            again = fit(image, reference, nearest_shift(image, reference, shift, NEAR))
            best = max(best, again, key=lambda found: (np.isfinite(found.std), found.agreement))
        return best

    def _is_still(self, found: Fit) -> bool:
        noise = STILL_STDS * found.std
        return bool(np.isfinite(noise)) and found.displacement < max(self.settings.still, noise)

    def _reason(
        self, found: Fit, image: np.ndarray, reference: CameraReference, state: CameraMotionState
    ) -> UnusableReason:
        """Returns why an image is unusable."""
        if not reference.textured:
            if light_gain(*(cv2.mean(item)[0] for item in (reference.small, image))) is None:
                return UnusableReason.LIGHT
            return UnusableReason.PRECISION if state.steady else UnusableReason.NONE
        if found.overlap < self.settings.least_overlap:
            return UnusableReason.OVERLAP
        if light_gain(1.0, found.gain) is None:
            return UnusableReason.LIGHT
        if found.agreement < POSSIBLE:
            return UnusableReason.MISMATCH
        precise = found.std <= self.settings.largest_std and found.scatter <= LARGEST_SCATTER
        return UnusableReason.NONE if precise or self._is_still(found) else UnusableReason.PRECISION


def _observation(
    verdict: Verdict,
    image: np.ndarray,
    found: Fit,
    reference: CameraReference,
    reason: UnusableReason = UnusableReason.NONE,
) -> CameraObservation:
    """Returns the findings about an image, aligned if its usability allows."""
    aligned, missing, scale = image, None, reference.factor
    transform = None if verdict is Verdict.UNUSABLE else IDENTITY
    if verdict in (Verdict.COMPENSATED, Verdict.DISPLACED):
        transform = read_only(reference.full_size(np.linalg.inv(found.warp)))
        aligned, missing = align(image, transform)
    return CameraObservation(
        verdict=verdict,
        reason=reason,
        image=aligned,
        missing=missing,
        transform=transform,
        displacement=scale * found.displacement,
        std=scale * found.std,
    )


def align(image: np.ndarray, transform: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns (an image as the reference camera would see it, mask of the pixels without data).

    Args:
        image: grey uint8 (h, w).
        transform: (3, 3) from its pixels to those of the reference.

    The mask is uint8 (h, w), 255 where a pixel has no data.
    """
    size = image.shape[::-1]
    aligned = cv2.warpPerspective(image, transform, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    seen = cv2.warpPerspective(np.full_like(image, 255), transform, size, flags=cv2.INTER_LINEAR)
    return aligned, cv2.compare(seen, 255, cv2.CMP_LT)


def edge_tolerance(reference: np.ndarray, shift: float) -> np.ndarray:
    """Returns what a difference to the reference must grant at each pixel, float32 (h, w) [grey levels].

    Alignment leaves a residual shift, which changes the brightness at edges by the shift times the gradient. The
    gradient taken here is the largest difference between a pixel and its eight neighbours, which is also right for
    lines of one pixel.

    Args:
        reference: grey uint8 (h, w).
        shift: the residual shift [px], at most 1.
    """
    kernel = np.ones((3, 3), np.uint8)
    steepest = cv2.max(
        cv2.subtract(cv2.dilate(reference, kernel), reference), cv2.subtract(reference, cv2.erode(reference, kernel))
    )
    return shift * steepest.astype(np.float32)


def _grey(image: np.ndarray, name: str) -> np.ndarray:
    """Returns a grey image itself, or raises DrakeTrackerError when it is none."""
    if image.dtype != np.uint8 or image.ndim != 2 or min(image.shape) < LEAST_SIDE:
        raise DrakeTrackerError(
            f"camera motion: {name} is an array {image.shape} of {image.dtype}; it must be uint8 (h, w), and at least "
            f"{LEAST_SIDE} px high and wide"
        )
    return image
