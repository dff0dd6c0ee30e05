"""Writes rubber.png, the texture of the belt: one tile, the direction of travel along the image's width.

The tile repeats along the belt without a visible joint. Run ``python -m models.belt.make_texture`` at the project's
root.
"""

from pathlib import Path

import cv2
import numpy as np

WIDTH, HEIGHT = 300, 240
"""Size of the tile [px], 1 mm each."""
MEAN = np.array([52.0, 56.0, 60.0])
"""Mean colour, RGB grey levels of 255."""
RIB, RIB_WIDTH = 150, 3
"""Distance between the stitched ribs across the belt, and their width [px]."""
EDGE = 8
"""Width of the worn edges of the belt [px]."""


def blurred(rng: np.random.Generator, along: float, across: float) -> np.ndarray:
    """Returns noise of unit deviation that repeats along the belt, blurred by deviations [px]."""
    noise = np.tile(rng.normal(size=(HEIGHT, WIDTH)), (1, 3))
    smooth = cv2.GaussianBlur(noise, (0, 0), sigmaX=along, sigmaY=across)[:, WIDTH : 2 * WIDTH]
    return smooth / smooth.std()


def rubber(rng: np.random.Generator) -> np.ndarray:
    """Returns the texture, (HEIGHT, WIDTH, 3) uint8 BGR: woven rubber with scuffs, ribs and worn edges."""
    tone = 4.0 * blurred(rng, 0.7, 0.7) + 3.0 * blurred(rng, 14.0, 1.2) + 4.0 * blurred(rng, 20.0, 12.0)
    columns, rows = np.arange(WIDTH), np.arange(HEIGHT)
    tone += 2.0 * np.sin(np.pi * (columns[None] + rows[:, None]) / 2.0)
    tone[:, columns % RIB < RIB_WIDTH] -= 14.0
    tone[(rows < EDGE) | (rows >= HEIGHT - EDGE)] += 16.0
    rgb = MEAN + tone[..., None]
    return np.round(np.clip(rgb[..., ::-1], 0.0, 255.0)).astype(np.uint8)


def main() -> None:
    """Writes the texture beside this script."""
    path = Path(__file__).resolve().parent / "rubber.png"
    cv2.imwrite(str(path), rubber(np.random.default_rng(1991)), [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
