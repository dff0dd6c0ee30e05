"""Tests of the pixels of colour images against an empty scene, and of the regions that they make up."""

import cv2
import numpy as np

from drake_tracker.vision.config import Contrast

RATIO_SCALE = 100.0
"""Number that stands for equal brightness in an 8-bit image of ratios."""
_SPECK, _MEDIUM = np.ones((2, 2), np.uint8), np.ones((5, 5), np.uint8)


def largest_channel(difference: np.ndarray) -> np.ndarray:
    """Returns the largest of the three channels (h, w, 3) of every pixel, (h, w)."""
    red, green, blue = cv2.split(difference)
    return cv2.max(cv2.max(red, green), blue)


def opened(mask: np.ndarray) -> np.ndarray:
    """Returns a mask without lines and specks of a single pixel.

    The anchors are opposite: OpenCV's own opening by a mask of even size shifts the image by a pixel.
    """
    return cv2.dilate(cv2.erode(mask, _SPECK, anchor=(0, 0)), _SPECK, anchor=(1, 1))


def shadow_like(image: np.ndarray, picture: np.ndarray, settings: Contrast) -> np.ndarray:
    """Returns where an image is darker than the empty scene, and of its colour, uint8 (h, w), 255 there.

    Args:
        image: uint8 (h, w, 3).
        picture: of the empty scene in the light of the image, uint8 (h, w, 3).
        settings: limits of brightness and colour.
    """
    ratios = cv2.split(cv2.divide(image, cv2.max(picture, 1), scale=RATIO_SCALE))
    lightest = cv2.max(cv2.max(ratios[0], ratios[1]), ratios[2])
    darkest = cv2.min(cv2.min(ratios[0], ratios[1]), ratios[2])
    allowed = cv2.convertScaleAbs(lightest, alpha=settings.shadow_spread)
    shadow = cv2.inRange(lightest, RATIO_SCALE * settings.shadow_darkest, RATIO_SCALE * settings.shadow_lightest)
    return cv2.bitwise_and(shadow, cv2.compare(cv2.subtract(lightest, darkest), allowed, cv2.CMP_LE))


def bodies(whole: np.ndarray, shadow: np.ndarray, body_share: float) -> np.ndarray:
    """Returns regions without their shadows, uint8 (h, w). A region that is nearly all shadow-like is a dark object.

    Args:
        whole: uint8 (h, w), 255 on the regions.
        shadow: uint8 (h, w), 255 where pixels are shadow-like.
        body_share: share of a region that is not shadow-like from which on the rest is its shadow.
    """
    body = opened(cv2.subtract(whole, shadow))
    body = cv2.bitwise_and(cv2.morphologyEx(body, cv2.MORPH_CLOSE, _MEDIUM), whole)
    count, labels = cv2.connectedComponents(whole, connectivity=8)
    kept, of = (np.bincount(labels[each > 0], minlength=count) for each in (body, whole))
    dark_object = kept < body_share * of
    if dark_object.any():
        np.copyto(body, whole, where=dark_object[labels])
    return body
