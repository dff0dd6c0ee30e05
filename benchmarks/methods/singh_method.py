"""Image flow with its covariance after Singh (1990): arithmetic of `singh_flow.py`.

A. Singh, *An estimation-theoretic framework for image-flow computation*, ICCV 1990. Two sources of information about
the velocity of a pixel are combined as estimates with covariances:

- conservation: the sum of squared differences (SSD) of a small window over all displacements of a search window, turned
  into the weights exp(-k SSD), whose mean and covariance are the estimate;
- neighbourhood: mean and covariance of the velocities around the pixel, with Gaussian weights.

Images are I0, I1, I2, equally spaced in time; displacements [px] are those from I1 to I2. As in Singh's own experiments
with three images, the SSD is the sum of those to I2 and, at the opposite displacement, to I0.
"""

from typing import NamedTuple

import cv2
import numpy as np
from scipy.special import ndtr

SEARCH = 3
"""Largest displacement searched along u and v [px]; the train moves up to 2 px between the images."""
WINDOW = 5
"""Side of the SSD's window [px]."""
ITERATIONS = 5
"""Rounds of the neighbourhood step."""
_LEAST_VARIANCE = 1e-3
"""Added to both diagonals [px^2]: a covariance computed from few values may be singular."""


class Flow(NamedTuple):
    """Velocity of each pixel of an image with its covariance.

    Attributes:
        mean: displacement (u, v) between two images, shape (h, w, 2) [px].
        covariance: its covariance, shape (h, w, 2, 2) [px^2].
    """

    mean: np.ndarray
    covariance: np.ndarray


class Centroid(NamedTuple):
    """Centroid of what moves.

    Attributes:
        uv: (u, v), shape (2,) [px].
        covariance: shape (2, 2) [px^2].
    """

    uv: np.ndarray
    covariance: np.ndarray


def conservation(images, k, search=SEARCH, window=WINDOW):
    """Returns the `Flow` of the conservation step.

    Args:
        images: I0, I1, I2, each (h, w) [grey].
        k: of the weights exp(-k SSD) [1/grey^2].
        search: largest displacement along u and v [px].
        window: side of the SSD's window [px], odd.
    """
    image0, image1, image2 = (np.asarray(image, np.float32) for image in images)
    steps = [(du, dv) for dv in range(-search, search + 1) for du in range(-search, search + 1)]
    ssd = np.stack([_ssd(image1, image2, image0, step, window) for step in steps])
    weight = np.exp(-k * (ssd - ssd.min(axis=0)))
    weight /= weight.sum(axis=0)
    d = np.array(steps, float)
    first, second = moments(weight, d)
    return Flow(first, second + _LEAST_VARIANCE * np.eye(2))


def moments(weight, d):
    """Returns mean (h, w, 2) and covariance (h, w, 2, 2) of displacements (n, 2) with the weights (n, h, w)."""
    mean = np.einsum("nhw,ni->hwi", weight, d)
    square = np.einsum("nhw,nij->hwij", weight, d[:, :, None] * d[:, None, :])
    return mean, square - mean[..., :, None] * mean[..., None, :]


def neighbourhood(flow, iterations=ITERATIONS):
    """Returns the `Flow` after the neighbourhood step: conservation and neighbourhood, each weighted by its inverse
    covariance, in rounds of Gauss and Jacobi."""
    information = np.linalg.inv(flow.covariance)
    known = np.einsum("hwij,hwj->hwi", information, flow.mean)
    mean, covariance = flow
    for _ in range(iterations):
        around = cv2.GaussianBlur(mean, (5, 5), 1.0)
        products = np.stack([mean[..., 0] ** 2, mean[..., 0] * mean[..., 1], mean[..., 1] ** 2], axis=-1)
        uu, uv, vv = np.moveaxis(cv2.GaussianBlur(products, (5, 5), 1.0), -1, 0)
        spread = np.stack([uu, uv, uv, vv], axis=-1).reshape(*uu.shape, 2, 2)
        spread = spread - around[..., :, None] * around[..., None, :] + _LEAST_VARIANCE * np.eye(2)
        other = np.linalg.inv(spread)
        covariance = np.linalg.inv(information + other)
        mean = np.einsum("hwij,hwj->hwi", covariance, known + np.einsum("hwij,hwj->hwi", other, around))
    return Flow(mean, covariance)


def moving_probability(flow, threshold):
    """Returns the probability (h, w) that a pixel moves by more than a threshold [px] in the direction of its mean."""
    speed = np.hypot(flow.mean[..., 0], flow.mean[..., 1])
    direction = flow.mean / np.maximum(speed, 1e-9)[..., None]
    variance = np.einsum("hwi,hwij,hwj->hw", direction, flow.covariance, direction)
    return ndtr((speed - threshold) / np.sqrt(np.maximum(variance, _LEAST_VARIANCE)))


def centroid(probability, window=WINDOW):
    """Returns the `Centroid` of pixels that move with the given probabilities (h, w); None when none does.

    The centroid sum(p x) / sum(p) has the derivative (x - c) / sum(p) with respect to one pixel's membership, whose
    variance is p (1 - p). The SSDs of pixels within one window share their data and hence their error, so that the sum
    of these variances counts once per pixel of the window.
    """
    total = probability.sum()
    if total < 1.0:
        return None
    v, u = np.indices(probability.shape)
    x = np.stack([u, v], axis=-1).astype(float)
    uv = np.einsum("hw,hwi->i", probability, x) / total
    arm = (x - uv) / total
    variance = probability * (1.0 - probability)
    return Centroid(uv, window**2 * np.einsum("hw,hwi,hwj->ij", variance, arm, arm))


def _ssd(image1, image2, image0, step, window):
    """Returns the SSD (h, w) of I1 with I2 at a displacement (du, dv), and with I0 at the opposite one."""
    difference = (_moved(image2, step) - image1) ** 2 + (_moved(image0, (-step[0], -step[1])) - image1) ** 2
    return cv2.boxFilter(difference, -1, (window, window), normalize=False)


def _moved(image, step):
    """Returns the image whose pixel (u, v) is that of ``image`` at (u + du, v + dv); the border is repeated."""
    du, dv = step
    reach = max(abs(du), abs(dv))
    padded = cv2.copyMakeBorder(image, reach, reach, reach, reach, cv2.BORDER_REPLICATE)
    height, width = image.shape
    return padded[reach + dv : reach + dv + height, reach + du : reach + du + width]
