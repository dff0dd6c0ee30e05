"""Images of the markers of a hand for tests, by ray casting on their drums. Nothing here knows of templates."""

import numpy as np

from drake_tracker.vision.hand.hand_markers import HALF_HEIGHT, HALF_MIDDLE, RADIUS

FINE = 3
"""Rays along each side of a pixel."""


def draw_drum(image, camera, p_WM, white_inside, light=(0.0, 0.0, 0.0)):
    """Draws a drum with a vertical axis into an image, float of shape (h, w), in place.

    Args:
        image: grey levels of a camera without distortion.
        camera: its model.
        p_WM: centre of the drum, shape (3,) [m].
        white_inside: whether the middle band is the white one.
        light: direction towards a lamp times the share of the brightness that depends on it.
    """
    u0, v0 = np.rint(camera.project(p_WM)[0]).astype(int) - 16
    v, u = np.mgrid[v0 : v0 + 33 : 1 / FINE, u0 : u0 + 33 : 1 / FINE] + (0.5 / FINE - 0.5)
    origin, rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
    o, d = (origin - p_WM)[:2], rays[:, :2]
    a, b, c = (d * d).sum(axis=1), d @ o, o @ o - RADIUS**2
    root = b * b - a * c
    along = (-b - np.sqrt(np.maximum(root, 0.0))) / a
    hit = (origin - p_WM) + along[:, None] * rays
    height = np.abs(hit[:, 2])
    white = (height < HALF_MIDDLE) == white_inside
    shade = 1.0 + (hit[:, :2] / RADIUS) @ np.asarray(light)[:2]
    level = np.where(white, 190.0, 20.0) * shade
    drawn = (root > 0.0) & (height < HALF_HEIGHT)
    shape = (33, FINE, 33, FINE)
    share = drawn.reshape(shape).mean(axis=(1, 3))
    total = np.where(drawn, level, 0.0).reshape(shape).mean(axis=(1, 3))
    part = image[v0 : v0 + 33, u0 : u0 + 33]
    part[:] = total + (1.0 - share) * part
