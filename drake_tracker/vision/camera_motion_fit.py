"""Robust fit of the homography between an image and a reference image of the same scene.

Gauss-Newton steps on the brightness of the reference's edge pixels, with the inverse compositional algorithm (Baker
and Matthews 2004, "Lucas-Kanade 20 years on: a unifying framework"), the weights of Tukey's biweight, and gain and
offset of the light as further parameters. Objects that move are outliers; a change of the light is not motion.
"""

from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.camera_motion_reference import LEAST_POINTS, CameraReference, EdgePixels

TUKEY = 4.685
"""Residual from which a pixel has no weight, in standard deviations."""
LEAST_NOISE = 0.7
"""Least standard deviation of the residuals: images are rounded to whole grey levels [grey levels]."""
PRIOR = np.array([0.05, 0.05, 1.0, 0.05, 0.05, 1.0, 0.05, 0.05, 0.5, 0.5])
"""Prior standard deviations of the parameters: homography in coordinates from -1 to 1, gain, and offset as a fraction
of the mean brightness. They keep a fit regular where the texture determines fewer parameters."""
PRIOR_INFORMATION = np.diag(PRIOR**-2.0)
"""Inverse covariance of the parameters before an image is seen."""
NO_SHAPE = np.zeros(8)
"""The eight parameters of the identity."""
STEPS = 20
"""Largest number of steps of a fit."""
LEAST_GAIN, LEAST_AGREEMENT = 0.1, 0.2
"""Bounds that keep quotients finite in images that have lost their contrast."""
CONVERGED, SETTLED = 0.01, 0.05
"""Step [px] at which a fit ends, and the largest last step of a fit that counts."""


class Search(NamedTuple):
    """Translations that `nearest_shift` tries.

    Attributes:
        radius: the largest in u and in v [px].
        step: difference between neighbours [px].
        points: number of edges.
    """

    radius: int
    step: int
    points: int


NEAR, WIDE = Search(6, 1, 500), Search(48, 2, 150)
"""The search around the previous displacement, and the one after the camera was lost."""


class Fit(NamedTuple):
    """A fit between an image and the reference.

    Attributes:
        warp: (3, 3) matrix from pixels of the reference to pixels of the image.
        displacement: root mean square displacement of the edge pixels [px].
        std: expected error of the displacement [px]; infinite when there are too few edge pixels, or when the steps did
            not converge.
        agreement: median over the edges of their contrast in the image over that in the reference. It is 1 when the
            edges are at their places and sharp, and 0 when the images have nothing in common.
        scatter: standard deviation of the contrasts around the agreement, as a share of the median contrast. Noise of
            the images adds to it; it exceeds 1 for images that have nothing in common, however well they seem to agree.
            The check leaves it at 0.
        overlap: share of the edge pixels that lie within the image.
        gain: brightness of the image over that of the reference.
    """

    warp: np.ndarray
    displacement: float
    std: float
    agreement: float
    scatter: float
    overlap: float
    gain: float


class _Step(NamedTuple):
    change: np.ndarray
    covariance: np.ndarray


NO_STEP = _Step(np.zeros(10), np.eye(10))
"""Start of a fit."""


def check_still(image: np.ndarray, reference: CameraReference) -> Fit:
    """Returns the fit of one step from no displacement, on few pixels; exact only for displacements below 0.5 px.

    Args:
        image: prepared by `prepare_image`.
        reference: of the same size.
    """
    edges = reference.checked
    if not reference.textured:
        return _no_fit()
    values, dark, bright = image.ravel().take(edges.flat).astype(np.float32).T
    residuals = values - edges.levels
    offset = _median(residuals)
    light = np.array([0.0, offset / reference.level])
    step = _step(edges, residuals - offset, light)
    light += step.change[8:]
    return Fit(
        np.eye(3),
        _size(step.change[:8], reference),
        _std(step.covariance, reference),
        _agreement(bright - dark, edges.contrasts, light),
        0.0,
        1.0,
        1.0 + float(light.sum()),
    )


def fit(image: np.ndarray, reference: CameraReference, warp: np.ndarray) -> Fit:
    """Returns the fit that Gauss-Newton steps find from a first estimate.

    Args:
        image: prepared by `prepare_image`.
        reference: of the same size.
        warp: (3, 3) first estimate of the matrix from pixels of the reference to those of the image.
    """
    edges, to_unit = reference.edges, reference.to_unit
    if not reference.textured:
        return _no_fit()
    from_unit = np.linalg.inv(to_unit)
    unit = to_unit @ warp @ from_unit
    unit /= unit[2, 2]
    light, step, moved, overlap, part = np.zeros(2), NO_STEP, np.inf, 1.0, edges
    for number in range(STEPS):
        places = _moved(edges.points, from_unit @ unit @ to_unit)
        seen = _seen(places, image.shape)
        overlap = float(seen.mean())
        if seen.sum() < LEAST_POINTS:
            return _no_fit(overlap)
        part = edges if seen.all() else edges.where(seen)
        values = _interpolated(image, places[seen])
        residuals = values - part.columns[:, 8:] @ light.astype(np.float32) - part.levels
        if number == 0:
            offset = _median(residuals)
            light[1] += offset / reference.level
            residuals = residuals - offset
        step = _step(part, residuals, light, (unit - np.eye(3)).ravel()[:8])
        unit = unit @ np.linalg.inv(np.eye(3) + np.append(step.change[:8], 0.0).reshape(3, 3))
        unit /= unit[2, 2]
        light = light + step.change[8:]
        moved = _size(step.change[:8], reference)
        if moved < CONVERGED:
            break
    warp = from_unit @ unit @ to_unit
    bright, dark = (_interpolated(image, _moved(side, warp)) for side in (part.bright, part.dark))
    agreement = _agreement(bright - dark, part.contrasts, light)
    expected = max(LEAST_AGREEMENT, agreement) * max(LEAST_GAIN, 1.0 + float(light[0])) * part.contrasts
    scatter = 1.4826 * _median(np.abs(bright - dark - expected)) / _median(expected)
    return Fit(
        warp,
        float(np.sqrt(np.mean(np.sum((_moved(edges.points, warp) - edges.points) ** 2, axis=1)))),
        _std(step.covariance, reference) if moved < SETTLED else np.inf,
        agreement,
        scatter,
        overlap,
        1.0 + float(light.sum()),
    )


def nearest_shift(image: np.ndarray, reference: CameraReference, warp: np.ndarray, search: Search) -> np.ndarray:
    """Returns a warp (3, 3) and the translation, of those searched, at which most edges have their contrast.

    Every translation is tried, which finds the right one among periodic edges, and when the image of an object that
    moves covers much of the reference.

    Args:
        image: prepared by `prepare_image`.
        reference: of the same size.
        warp: (3, 3) first estimate of the matrix from pixels of the reference to those of the image.
        search: which translations.
    """
    edges, radius = reference.checked, search.radius
    edges = edges.where(np.arange(len(edges.points)) % max(1, len(edges.points) // search.points) == 0)
    padded = cv2.copyMakeBorder(image, *(4 * (radius,)), cv2.BORDER_REPLICATE).astype(np.int16)
    width = padded.shape[1]
    offsets = np.arange(0, 2 * radius + 1, search.step)
    shifts = (width * offsets[:, np.newaxis] + offsets).reshape(-1, 1)
    flat = padded.ravel()
    highest = np.array(image.shape[::-1]) - 1
    bright, dark = (
        flat[np.clip(np.rint(_moved(side, warp)).astype(np.intp), 0, highest) @ [1, width] + shifts]
        for side in (edges.bright, edges.dark)
    )
    contrasts = edges.contrasts.astype(np.int16)
    misses = np.minimum(np.abs(bright - dark - contrasts), contrasts).sum(axis=1, dtype=np.int64)
    dv, du = np.divmod(int(misses.argmin()), len(offsets))
    shift = np.eye(3)
    shift[:2, 2] = offsets[du] - radius, offsets[dv] - radius
    return shift @ warp


def _step(edges: EdgePixels, residuals: np.ndarray, light: np.ndarray, shape: np.ndarray = NO_SHAPE) -> _Step:
    """Returns a Gauss-Newton step.

    Args:
        edges: edge pixels.
        residuals: (n,) brightness of the image minus that of the reference in the present light [grey levels].
        light: (2,) present gain and offset.
        shape: (8,) present parameters of the homography.
    """
    noise = max(LEAST_NOISE, 1.4826 * _median(np.abs(residuals)))
    ratio = np.minimum(np.abs(residuals) * np.float32(1.0 / (TUKEY * noise)), np.float32(1.0))
    weights = (1.0 - ratio * ratio) ** 2
    weighted = edges.columns * (weights * np.float32(noise**-2))[:, np.newaxis]
    covariance = np.linalg.inv((edges.columns.T @ weighted).astype(float) + PRIOR_INFORMATION)
    # After the step, the parameters of the homography are about (shape - change), and those of the light
    # (light + change). The prior draws both to zero.
    slope = (residuals @ weighted).astype(float)
    slope[:8] += PRIOR[:8] ** -2.0 * shape
    slope[8:] -= PRIOR[8:] ** -2.0 * light
    return _Step(covariance @ slope, covariance)


def _median(values: np.ndarray) -> float:
    """Returns the upper median: half the time of `numpy.median`."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def _size(change: np.ndarray, reference: CameraReference) -> float:
    return float(np.sqrt(change @ reference.metric @ change))


def _std(covariance: np.ndarray, reference: CameraReference) -> float:
    return float(np.sqrt(np.sum(covariance[:8, :8] * reference.metric)))


def _agreement(contrasts: np.ndarray, reference: np.ndarray, light: np.ndarray) -> float:
    return _median(contrasts / reference) / max(LEAST_GAIN, 1.0 + float(light[0]))


def _moved(points: np.ndarray, warp: np.ndarray) -> np.ndarray:
    return cv2.perspectiveTransform(points[np.newaxis], warp)[0]


def _seen(places: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    u, v = places.T
    return (u >= 1.0) & (u <= shape[1] - 2.0) & (v >= 1.0) & (v <= shape[0] - 2.0)


def _interpolated(image: np.ndarray, places: np.ndarray) -> np.ndarray:
    return cv2.remap(image, places[np.newaxis], None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0].astype(
        np.float32
    )


def _no_fit(overlap: float = 1.0) -> Fit:
    return Fit(np.eye(3), 0.0, np.inf, 0.0, np.inf, overlap, 1.0)
