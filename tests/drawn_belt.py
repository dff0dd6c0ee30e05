"""Images of parts on a moving, textured belt, drawn without a renderer."""

import cv2
import numpy as np

from drake_tracker.core.constants import SIDES
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.tasks.calibrated import calibrated_cameras
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.conveyor.setup import resolve
from drake_tracker.vision.parts.belt_surface import BeltSurface
from drake_tracker.vision.parts.part_fit import SeenWindow, soften
from drake_tracker.vision.parts.part_search import PartSearch
from drake_tracker.vision.parts.part_silhouette import PartPose, PartSilhouette
from drake_tracker.vision.parts.part_tracker import PartImage, PartTracker
from drake_tracker.vision.parts.part_vision_diagram import belt_window

SCENARIO = ConveyorScenario()
HEIGHT = SCENARIO.belt.height
CAMERAS = calibrated_cameras(SCENARIO)
WINDOWS = resolve(SCENARIO).windows
BELT = resolve(SCENARIO).seen_belt
MASKS = {side: belt_window(CAMERAS[side], BELT, HEIGHT).mask(WINDOWS[side]) for side in SIDES}
SILHOUETTES = [PartSilhouette(CAMERAS[side], WINDOWS[side], HEIGHT) for side in SIDES]
COLOURS = {PartKind.BOX: (232, 195, 58), PartKind.DISC: (216, 87, 60), PartKind.ELL: (63, 143, 208)}


def surfaces():
    return [BeltSurface(CAMERAS[side], WINDOWS[side], MASKS[side], HEIGHT) for side in SIDES]


def make_search():
    return PartSearch([CAMERAS[side] for side in SIDES], [WINDOWS[side] for side in SIDES], HEIGHT, BELT)


def make_tracker(**settings):
    return PartTracker(SILHOUETTES, make_search(), SCENARIO.belt.end, **settings)


def shares(poses):
    """The share of each pixel that parts cover, float32 (h, w), for each camera."""
    result = []
    for side, silhouette in zip(SIDES, SILHOUETTES):
        share = np.zeros(MASKS[side].shape, np.float32)
        for pose in poses:
            patch = silhouette.patch(pose)
            if patch is not None:
                own = share[patch.rows, patch.columns]
                np.maximum(own, patch.share, out=own)
        result.append(share)
    return result


def part_images(poses, hidden=None):
    """What ideal segmentation shows of parts; ``hidden``: uint8 masks of the arm."""
    images = []
    for k, share in enumerate(shares(poses)):
        unseen = cv2.bitwise_not(MASKS[SIDES[k]])
        mask = np.where(share >= 0.5, np.uint8(255), np.uint8(0))
        if hidden is not None:
            unseen = cv2.bitwise_or(unseen, hidden[k])
        images.append(PartImage(cv2.subtract(mask, unseen), unseen))
    return images


def windows(poses):
    return [
        SeenWindow(silhouette, soften(image.mask / np.float32(255.0)), np.where(image.unseen, 0, 1).astype(np.float32))
        for silhouette, image in zip(SILHOUETTES, part_images(poses))
    ]


def photographs(poses, travelled=0.0, light=1.0, noise=2.0, seed=0):
    """Colour images of parts on a belt whose texture has travelled a distance [m]."""
    random = np.random.default_rng(seed)
    result = []
    for side, share in zip(SIDES, shares(poses)):
        height, width = share.shape
        v, u = np.mgrid[:height, :width]
        texture = 42.0 + 3.0 * np.sin(0.9 * u + 400.0 * travelled) + 3.0 * np.sin(0.7 * v - 300.0 * travelled)
        image = np.repeat(texture[..., None], 3, axis=2) + 0.02 * u[..., None]
        for pose in poses:
            own = shares([pose])[SIDES.index(side)][..., None]
            image = (1.0 - own) * image + own * np.array(COLOURS[pose.kind])
        image = light * image + noise * random.standard_normal(image.shape)
        result.append(np.clip(np.rint(image), 0, 255).astype(np.uint8))
    return result


def pose(kind, x=0.6, y=0.0, yaw=0.0):
    return PartPose(kind, x, y, yaw)
