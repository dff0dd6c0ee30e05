"""Writes wood.png, the texture of the table's top: dark planks with grain, the table's y axis along the image's width.

Run ``python -m models.table.make_texture`` at the project's root.
"""

from pathlib import Path

import cv2
import numpy as np

WIDTH, HEIGHT = 800, 560
PLANKS = 7
DARK, LIGHT = np.array([40.0, 27.0, 19.0]), np.array([104.0, 74.0, 54.0])
"""Colours between which the wood varies, RGB grey levels of 255."""


def grain(rng: np.random.Generator) -> np.ndarray:
    """Returns an image in 0..1: fine fibres along the planks over a coarse pattern."""
    fibre = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH)), (0, 0), sigmaX=28.0, sigmaY=0.9)
    figure = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH)), (0, 0), sigmaX=90.0, sigmaY=7.0)
    rings = np.sin(14.0 * figure / figure.std() + 0.02 * np.arange(WIDTH))
    return 0.5 + 0.13 * fibre / fibre.std() + 0.10 * rings


def wood(rng: np.random.Generator) -> np.ndarray:
    """Returns the texture, (HEIGHT, WIDTH, 3) uint8 BGR: planks of different tones with dark joints between them."""
    plank_height = HEIGHT // PLANKS
    tone = np.empty((HEIGHT, WIDTH))
    for plank in range(PLANKS):
        rows = slice(plank * plank_height, (plank + 1) * plank_height)
        tone[rows] = np.roll(grain(rng)[rows], 97 * plank, axis=1) + rng.uniform(-0.15, 0.15)
        tone[rows.start] -= 0.5
        tone[rows.stop - 1] -= 0.35
    rgb = DARK + np.clip(tone, 0.0, 1.0)[..., None] * (LIGHT - DARK)
    return np.round(rgb[..., ::-1]).astype(np.uint8)


def main() -> None:
    """Writes the texture beside this script."""
    path = Path(__file__).resolve().parent / "wood.png"
    cv2.imwrite(str(path), wood(np.random.default_rng(1991)), [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
