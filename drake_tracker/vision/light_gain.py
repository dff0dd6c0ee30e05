"""The change of illumination between two images, so that flicker of lamps does not count as motion."""

import math

import numpy as np

GAIN_LIMITS = (2 / 3, 3 / 2)
"""When the brightness changes by a larger factor between two images, the light was switched: no motion can be found."""

SAME_LIGHT = 0.004
"""Changes of the brightness below this share are not compensated."""
LINES = 64
"""Number of rows and columns of an image in which bands are looked for."""
BAND = 0.02
"""Least deviation of a line's light from that of the whole image, as a share, that counts as a band."""
BAND_SHARE, BAND_AGREEMENT = 0.2, 0.75
"""Least share of the lines that lie in bands, and of the pixels that agree with the light of their line."""


def light_gain(level0: float, level1: float) -> float | None:
    """Returns the factor that scales an image of total brightness ``level0`` to another image of ``level1``.

    Args:
        level0: brightness of the earlier image, in any unit.
        level1: brightness of the later image, in the same unit.

    Returns None when the factor is outside `GAIN_LIMITS`.
    """
    gain = level1 / level0 if level0 > 0.0 else math.inf
    return gain if GAIN_LIMITS[0] < gain < GAIN_LIMITS[1] else None


def with_light_of(reference: np.ndarray, image: np.ndarray) -> np.ndarray:
    """Returns an image without bands: each of its lines is scaled to the light of the same line of another image.

    A rolling shutter reads line after line while the lamps flicker. The lines are the rows of the image, or the columns
    if the camera was upright. Without bands, and where the camera moves, the given image is returned itself.

    Args:
        reference: grey image (h, w).
        image: of the same shape and type.
    """
    step = max(1, min(image.shape) // LINES)
    after, before = (each[::step, ::step].astype(np.float32) for each in (reference, image))
    ratios = np.maximum(after, 1.0) / np.maximum(before, 1.0)
    for axis in (1, 0):
        gains = _line_gains(ratios, axis)
        if gains is not None:
            lines = np.arange(image.shape[1 - axis])
            scaled = image * np.expand_dims(np.interp(lines, lines[::step], gains).astype(np.float32), axis)
            if image.dtype.kind == "f":
                return scaled.astype(image.dtype)
            return np.clip(np.rint(scaled), 0, np.iinfo(image.dtype).max).astype(image.dtype)
    return image


def _line_gains(ratios: np.ndarray, axis: int) -> np.ndarray | None:
    """Returns the median of the ratios of brightness along an axis, None if no bands explain the ratios."""
    off = ratios.mean(axis=axis)
    off -= off.mean()
    if off @ off < 0.5 * len(off) * BAND_SHARE * BAND**2:  # soon found in most images
        return None
    gains = np.median(ratios, axis=axis)
    common = np.median(gains)
    bands = np.abs(gains - common) > BAND * common
    agree = np.abs(ratios - np.expand_dims(gains, axis)) < 1.5 * BAND * common
    return gains if bands.mean() >= BAND_SHARE and agree.mean() >= BAND_AGREEMENT else None
