"""A level of the image pyramid: objects are tracked in a smaller image, with results in pixels of the full one."""

from dataclasses import replace

import cv2
import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.track_2d import Track2D
from drake_tracker.vision.region_centroid import enlarged_place, reduced


def reduced_window(window: np.ndarray | None, factor: int) -> np.ndarray | None:
    """Returns a window, uint8 (h, w), 0 where motion does not count, for the reduced image; None stays None."""
    if window is None or factor == 1:
        return window
    return cv2.threshold(reduced(window, factor), 127, 255, cv2.THRESH_BINARY)[1]


def reduced_pixel(pixel: tuple[float, float] | None, factor: int) -> tuple[float, float] | None:
    """Returns where a pixel (u, v) of an image is in the reduced one; None stays None."""
    if pixel is None:
        return None
    u, v = ((value + 0.5) / factor - 0.5 for value in pixel)
    return u, v


def enlarged(objects: ImageObjects, factor: int) -> ImageObjects:
    """Returns the objects in a reduced image in pixels of the full one. Their patches and scenes stay as they are.

    Args:
        objects: in the reduced image.
        factor: see `reduced`.
    """
    if factor == 1:
        return objects
    return replace(
        objects,
        tracks=tuple(_enlarged_track(track, factor) for track in objects.tracks),
        lost=tuple(None if track is None else _enlarged_track(track, factor) for track in objects.lost),
        displacement=factor * objects.displacement,
    )


def _enlarged_track(track: Track2D, factor: int) -> Track2D:
    mean = factor * track.mean
    mean[:2] = enlarged_place(track.mean[:2], factor)
    return replace(
        track,
        mean=read_only(mean),
        covariance=read_only(factor**2 * track.covariance),
        width=factor * track.width,
        height=factor * track.height,
        pixel_count=factor**2 * track.pixel_count,
        place=read_only(enlarged_place(track.place, factor)),
        area=factor**2 * track.area,
        moving=factor**2 * track.moving,
        region=None if track.region is None else _enlarged_region(track.region, factor),
    )


def _enlarged_region(region: ImageRegion, factor: int) -> ImageRegion:
    return ImageRegion(
        enlarged_place(region.u, factor),
        enlarged_place(region.v, factor),
        factor**2 * region.pixel_count,
        factor * region.left,
        factor * region.top,
        factor * region.width,
        factor * region.height,
        region.exact,
        None if region.inner is None else _enlarged_region(region.inner, factor),
    )
