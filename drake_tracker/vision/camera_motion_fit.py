"""Robust fit of the homography between an image and a reference image of the same scene.

Gauss-Newton steps on the brightness of the reference's edge pixels, with the inverse compositional algorithm (Baker
and Matthews 2004, "Lucas-Kanade 20 years on: a unifying framework"), the weights of Tukey's biweight, and gain and
offset of the light as further parameters. Objects that move are outliers; a change of the light is not motion.
"""

from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.camera_motion_reference import CameraReference, EdgePixels, sample

TUKEY = 4.685
"""Residual from which a pixel has no weight, in standard deviations."""
LEAST_NOISE = 0.7
"""Least standard deviation of the residuals: images are rounded to whole grey levels [grey levels]."""
PRIOR = np.array([0.05, 0.05, 1.0, 0.05, 0.05, 1.0, 0.05, 0.05, 0.5, 0.5])
"""Prior standard deviations of the parameters: homography in coordinates from -1 to 1, gain, and offset as a fraction
of the mean brightness. They keep a fit regular where the texture determines fewer parameters."""
STEPS = 15
"""Largest number of steps of a fit."""
CONVERGED = 0.01
"""Step [px] at which a fit has converged."""
LEAST_POINTS = 60
"""Least number of edge pixels for a fit."""


class Fit(NamedTuple):
    """A fit between an image and the reference.

    Attributes:
        warp: (3, 3) matrix from pixels of the reference to pixels of the image.
        displacement: root mean square displacement of the edge pixels [px].
        std: expected error of the displacement [px]; infinite when there are too few edge pixels.
        residual: standard deviation of the brightness around the fit, without outliers [grey levels].
        inliers: share of the edge pixels whose brightness the fit explains.
        agreement: median over the edges of their contrast in the image over that in the reference. It is 1 when the
            edges are at their places and sharp, and 0 when the images have nothing in common.
        overlap: share of the edge pixels that lie within the image.
        gain: brightness of the image over that of the reference.
    """

    warp: np.ndarray
    displacement: float
    std: float
    residual: float
    inliers: float
    agreement: float
    overlap: float
    gain: float


class _Step(NamedTuple):
    change: np.ndarray
    covariance: np.ndarray
    residual: float
    inliers: float


def check_still(image: np.ndarray, reference: CameraReference) -> Fit:
    """Returns the fit of one step from no displacement, on few pixels; exact only for displacements below 0.5 px.

    Args:
        image: prepared by `prepare_image`.
        reference: of the same size.
    """
    edges = reference.checked
    if len(edges.points) < LEAST_POINTS:
        return _no_fit()
    values = sample(image, edges.points)
    residuals = values - edges.levels
    offset = np.median(residuals)
    light = np.array([0.0, offset / reference.level])
    step = _step(edges, residuals - offset, np.append(np.zeros(8), light))
    light += step.change[8:]
    contrasts = sample(image, edges.bright) - sample(image, edges.dark)
    return Fit(
        np.eye(3),
        _size(step.change[:8], reference),
        _std(step.covariance, reference),
        step.residual,
        step.inliers,
        _agreement(contrasts, edges.contrasts, light),
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
    if len(edges.points) < LEAST_POINTS:
        return _no_fit()
    from_unit = np.linalg.inv(to_unit)
    unit = to_unit @ warp @ from_unit
    unit /= unit[2, 2]
    light, step, seen = np.zeros(2), None, np.zeros(0)
    for number in range(STEPS):
        places = _moved(edges.points, from_unit @ unit @ to_unit)
        seen = _seen(places, image.shape)
        if seen.sum() < LEAST_POINTS:
            return _no_fit()
        part = edges if seen.all() else edges.where(seen)
        values = _interpolated(image, places[seen])
        residuals = values - part.columns[:, 8:] @ light.astype(np.float32) - part.levels
        if number == 0:
            offset = float(np.median(residuals))
            light[1] += offset / reference.level
            residuals = residuals - offset
        parameters = np.append((unit - np.eye(3)).ravel()[:8], light)
        step = _step(part, residuals, parameters)
        change = np.append(step.change[:8], 0.0).reshape(3, 3)
        unit = unit @ np.linalg.inv(np.eye(3) + change)
        unit /= unit[2, 2]
        light = light + step.change[8:]
        if _size(step.change[:8], reference) < CONVERGED:
            break
    warp = from_unit @ unit @ to_unit
    ends = [_interpolated(image, _moved(side, warp)) for side in (part.bright, part.dark)]
    return Fit(
        warp,
        float(np.sqrt(np.mean(np.sum((_moved(edges.points, warp) - edges.points) ** 2, axis=1)))),
        _std(step.covariance, reference),
        step.residual,
        step.inliers,
        _agreement(ends[0] - ends[1], part.contrasts, light),
        float(_seen(places, image.shape).mean()),
        1.0 + float(light.sum()),
    )


def shift_estimate(image: np.ndarray, reference: CameraReference) -> np.ndarray:
    """Returns a first estimate of a large displacement, a translation (3, 3), by phase correlation.

    Args:
        image: prepared by `prepare_image`.
        reference: of the same size.
    """
    pair = [np.float32(item) - np.float32(np.mean(item)) for item in (reference.small, image)]
    (du, dv), _ = cv2.phaseCorrelate(*pair, cv2.createHanningWindow(image.shape[::-1], cv2.CV_32F))
    return np.array([[1.0, 0.0, du], [0.0, 1.0, dv], [0.0, 0.0, 1.0]])


def _step(edges: EdgePixels, residuals: np.ndarray, parameters: np.ndarray) -> _Step:
    noise = max(LEAST_NOISE, 1.4826 * float(np.median(np.abs(residuals))))
    ratio = np.minimum(np.abs(residuals) * (1.0 / (TUKEY * noise)), 1.0)
    weights = (1.0 - ratio * ratio) ** 2
    weighted = edges.columns * weights[:, np.newaxis]
    information = (edges.columns.T @ weighted).astype(float) / noise**2 + np.diag(PRIOR**-2.0)
    # The parameters after the step are about (parameters - change) for the homography, (parameters + change) for the
    # light; the prior draws them to zero.
    pull = np.append(parameters[:8], -parameters[8:]) / PRIOR**2
    covariance = np.linalg.inv(information)
    change = covariance @ ((residuals @ weighted).astype(float) / noise**2 + pull)
    return _Step(change, covariance, noise, float(np.mean(ratio < 0.64)))


def _size(change: np.ndarray, reference: CameraReference) -> float:
    return float(np.sqrt(change @ reference.metric @ change))


def _std(covariance: np.ndarray, reference: CameraReference) -> float:
    return float(np.sqrt(np.sum(covariance[:8, :8] * reference.metric)))


def _agreement(contrasts: np.ndarray, reference: np.ndarray, light: np.ndarray) -> float:
    return float(np.median(contrasts / reference)) / max(0.1, 1.0 + float(light[0]))


def _moved(points: np.ndarray, warp: np.ndarray) -> np.ndarray:
    return cv2.perspectiveTransform(points[np.newaxis], warp)[0]


def _seen(places: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    u, v = places.T
    return (u >= 1.0) & (u <= shape[1] - 2.0) & (v >= 1.0) & (v <= shape[0] - 2.0)


def _interpolated(image: np.ndarray, places: np.ndarray) -> np.ndarray:
    return cv2.remap(image, places[np.newaxis], None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0].astype(
        np.float32
    )


def _no_fit() -> Fit:
    return Fit(np.eye(3), 0.0, np.inf, 0.0, 0.0, 0.0, 1.0, 1.0)
