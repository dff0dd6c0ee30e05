"""The picture of the intermediate images of a ball detector at one instant."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.tasks.style import PLOT_STYLE
from drake_tracker.vision.centroid.frame_difference import DifferenceImages


def draw_difference_images(images: DifferenceImages, titles: Sequence[str], path: Path) -> None:
    """Draws the intermediate images of a detector at one instant, like figure 4 of Nashman and Chaconas 1990.

    Args:
        images: the images.
        titles: titles of the two images and of the mask.
        path: PNG file to write.
    """
    columns = tuple(zip("abc", titles, (images.reference, images.smoothed, images.motion_energy)))
    height, width = images.smoothed.shape
    moving = np.argwhere(images.motion_energy)
    box = None
    if len(moving):
        v, u = np.median(moving, axis=0)
        half = 0.09 * max(width, height)
        box = (np.clip(u, half, width - half), np.clip(v, half, height - half), half)
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(15, 5.0 * height / width + 0.6), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        for ax, (letter, title, image) in zip(figure.subplots(1, 3), columns):
            look = {"cmap": "gray", "vmin": 0, "vmax": 255, "interpolation": "nearest"}
            ax.imshow(image, **look)
            ax.set(xticks=[], yticks=[])
            ax.spines[:].set_visible(False)
            ax.set_title(f"{letter}   {title}")
            if box is not None:
                _enlarge(ax, image, box, look)
        with replacing(path) as beside:
            figure.savefig(beside, dpi=200)


def _enlarge(ax: Axes, image: np.ndarray, box: tuple[float, float, float], look: dict[str, Any]) -> None:
    """Marks a square part of an image and shows it enlarged in the opposite corner.

    Args:
        ax: axes with the image.
        image: the image.
        box: centre and half the side of the part (u, v, half) [px].
        look: keywords of ``imshow``.
    """
    u, v, half = box
    height, width = image.shape
    ax.add_patch(Rectangle((u - half, v - half), 2 * half, 2 * half, fc="none", ec="#e69f00", lw=1.4))
    corner = (0.63 if u < 0.5 * width else 0.02, 0.63 if v > 0.5 * height else 0.02)
    part = ax.inset_axes((*corner, 0.35, 0.35))
    part.imshow(image, **look)
    part.set(xlim=(u - half, u + half), ylim=(v + half, v - half), xticks=[], yticks=[])
    part.spines[:].set(visible=True, color="#e69f00", lw=1.4)
