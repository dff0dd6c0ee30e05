"""Where an object is expected in space: a Kalman filter of its position and velocity that takes one ray or two.

The ray of one camera fixes the object across that ray. If the other camera loses an object for a while, the object is
therefore expected at the right place when it reappears, except for its distance from the first camera.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.image_tracks.track_2d import (
    PIXEL_ERROR,
    POSITION_ERROR,
    Track2D,
    constant_velocity,
)

START_SPEED = 10.0
"""Standard deviation of each component of an unknown velocity, in sizes per second."""


class ObjectRay(NamedTuple):
    """The ray to an object in one image.

    Attributes:
        origin: the camera, shape (3,) [m].
        direction: unit vector, shape (3,).
        std: standard deviation of the distance of the object from the ray, in each direction across it [m].
    """

    origin: np.ndarray
    direction: np.ndarray
    std: float


@dataclass(frozen=True, eq=False)
class ObjectMotion(FrozenState):
    """Position and velocity of an object.

    Attributes:
        stamp: of the estimate [s].
        mean: position [m] and velocity [m/s], shape (6,).
        covariance: of the mean, shape (6, 6).
        size: of the object [m].
    """

    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    size: float


def start_motion(p_WQ: np.ndarray, size: float, stamp: float) -> ObjectMotion:
    """Returns the motion of an object that was seen at a point (3,) [m], of which only the size [m] is known."""
    covariance = size**2 * np.diag([1.0] * 3 + [START_SPEED**2] * 3)
    return ObjectMotion(stamp, read_only(np.concatenate([p_WQ, np.zeros(3)])), read_only(covariance), size)


def predict_motion(motion: ObjectMotion, stamp: float) -> ObjectMotion:
    """Returns a motion at a later time [s]: the velocity changes as in a `Track2D`."""
    dt, speed = max(stamp - motion.stamp, 0.0), float(np.linalg.norm(motion.mean[3:]))
    mean, covariance = constant_velocity(motion.mean, motion.covariance, dt, speed, motion.size)
    return replace(motion, stamp=stamp, mean=mean, covariance=covariance)


def ray_to(track: Track2D, camera: CameraModel, p_WQ: np.ndarray, error: float) -> ObjectRay:
    """Returns the ray to the object of a track.

    Args:
        track: seen in an image of the camera.
        camera: calibrated.
        p_WQ: about where the object is, shape (3,) [m].
        error: standard deviation of the ray's place by the calibration [m].
    """
    origin, direction = camera.ray(*track.place.tolist())
    metres = math.dist(p_WQ, origin) / camera.focal_lengths[0]
    return ObjectRay(origin, direction, math.hypot((POSITION_ERROR * track.size + PIXEL_ERROR) * metres, error))


def surprise(motion: ObjectMotion, rays: Sequence[ObjectRay]) -> tuple[float, float]:
    """Returns how unlikely it is that rays lead to an object, in two parts that are not negative: both are 0 at best.

    These are the squared Mahalanobis distance of the rays from where the object is expected, and how much less certain
    that place is than the rays are: the logarithm of the ratio of the determinants of their covariances.
    """
    H, z, r = _equations(rays)
    S = H @ motion.covariance @ H.T + np.diag(r)
    innovation = z - H @ motion.mean
    distance = float(innovation @ np.linalg.solve(S, innovation))
    return distance, float(np.linalg.slogdet(S)[1] - np.log(r).sum())


def with_rays(motion: ObjectMotion, rays: Sequence[ObjectRay]) -> ObjectMotion:
    """Returns a motion after rays to the object at the same time."""
    H, z, r = _equations(rays)
    P = motion.covariance
    K = np.linalg.solve(H @ P @ H.T + np.diag(r), H @ P).T
    mean, P = motion.mean + K @ (z - H @ motion.mean), P - K @ H @ P
    return replace(motion, mean=read_only(mean), covariance=read_only(0.5 * (P + P.T)))


def _equations(rays: Sequence[ObjectRay]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns H (2n, 6), z (2n,) and the variances of z: a point on a ray has the same two coordinates across it as
    the camera."""
    across = [np.linalg.svd(ray.direction[None])[2][1:] for ray in rays]
    H = np.hstack([np.vstack(across), np.zeros((2 * len(rays), 3))])
    z = np.concatenate([each @ ray.origin for each, ray in zip(across, rays)])
    return H, z, np.repeat([ray.std**2 for ray in rays], 2)
