"""Clips whose background and object are photographs, for `footage.py`.

The photographs are those that the package scikit-image brings with it, all in the public domain or under CC0: astronaut
(NASA), brick, grass and gravel (Poly Haven), camera, chelsea, coffee, and rocket (SpaceX).
"""

from dataclasses import replace

import cv2
import numpy as np
from footage_parts.clips import HEIGHT, MARGIN, WIDTH, disc, make_clip

NAMES = ("astronaut", "brick", "camera", "chelsea", "coffee", "grass", "gravel", "rocket")
KINDS = ("plain", "shake", "pan")


def available():
    """Returns whether scikit-image is installed."""
    try:
        import skimage.data  # noqa: F401
    except ImportError:
        return False
    return True


def photograph(name):
    """Returns a photograph in grey, uint8 (h, w)."""
    from skimage import data

    image = getattr(data, name)()
    return image if image.ndim == 2 else cv2.cvtColor(image[..., :3], cv2.COLOR_RGB2GRAY)


def cut(rng, image, width, height):
    """Returns a random piece of a photograph, enlarged where it is too small, float32 (height, width)."""
    scale = max(1.0, width / image.shape[1], height / image.shape[0])
    image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC) if scale > 1.0 else image
    v = rng.integers(image.shape[0] - height + 1)
    u = rng.integers(image.shape[1] - width + 1)
    return image[v : v + height, u : u + width].astype(np.float32)


def make_photographed(kind, seed):
    """Returns a `Clip` of a kind in which a disc cut out of one photograph moves before another one."""
    rng = np.random.default_rng([seed, 1])
    behind, before = rng.choice(NAMES, 2, replace=False)
    sky = cut(rng, photograph(behind), WIDTH + 2 * MARGIN, HEIGHT + 2 * MARGIN)
    thing = disc(rng, rng.uniform(30.0, 50.0), 0.0)
    side = len(thing.texture)
    return make_clip(kind, seed, sky=sky, thing=replace(thing, texture=cut(rng, photograph(before), side, side)))
