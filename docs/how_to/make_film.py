"""Draws a film of a bright disc on an ellipse, for the guide "Use other cameras"."""

from pathlib import Path

import cv2
import numpy as np

folder = Path("shots")
folder.mkdir()
rng = np.random.default_rng(0)
for k in range(60):
    angle = 2.0 * np.pi * k / 60
    image = np.full((240, 320), 50.0) + rng.normal(0.0, 1.5, (240, 320))
    centre = round(160 + 80 * np.cos(angle)), round(120 + 60 * np.sin(angle))
    cv2.circle(image, centre, 12, 200.0, thickness=-1)
    cv2.imwrite(str(folder / f"{k:04d}.png"), image.clip(0, 255).astype(np.uint8))
