"""The picture of how the board was found: by the camera in the first image, and by touch."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.tasks.ball.setup import BallSetup
from drake_tracker.tasks.plots import name_colours
from drake_tracker.tasks.style import FAR_PREDICTED, HAND, INK, PLOT_STYLE, PREDICTED, SOFT_INK
from drake_tracker.vision.centroid.frame_difference import DifferenceImages
from drake_tracker.world.ball.ball_board import CIRCLE_RADIUS, CIRCLES, TOUCH_MARKS, face_corners

ZOOM = 15
"""Side of the square part of the image that is enlarged [px]."""


def draw_board_found(setup: BallSetup, summary: Mapping[str, Any], path: Path) -> None:
    """Draws the first image of the initialisation with outline, circles and marks of the board at the pose found.

    Args:
        setup: the resolved scenario of the run.
        summary: the return value of `summarise_ball`.
        path: PNG file to write.
    """
    poses = setup.poses
    camera = setup.camera
    touched = (poses.X_WB.inverse() @ poses.points.T).T if len(poses.points) else np.zeros((0, 3))
    touched[:, 2] = 0.0  # position of the tip on the face
    outline = camera.project(face_corners(setup.scenario.board))
    marks = camera.project(_on_face(TOUCH_MARKS))
    turn = np.linspace(0.0, 2.0 * np.pi, 61)
    rims = [
        camera.project(_on_face(np.add(centre, CIRCLE_RADIUS * np.column_stack([np.cos(turn), np.sin(turn)]))))
        for centre in CIRCLES
    ]
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(14, 8.2), facecolor="white")
        FigureCanvasAgg(figure)

        def show(ax: Axes) -> None:
            ax.imshow(poses.image, interpolation="nearest")
            ax.plot(*np.vstack([outline, outline[:1]]).T, color=PREDICTED, lw=1.8)
            for rim in rims:
                ax.plot(*rim.T, color=FAR_PREDICTED, lw=1.3)
            ax.plot(*poses.circles.T, "+", color=FAR_PREDICTED, ms=9, mew=1.6)
            ax.plot(*marks.T, "o", mfc="none", mec=HAND, ms=11, mew=1.6)
            ax.plot(*camera.project(touched).T, "+", color=HAND, ms=9, mew=1.8)
            ax.set(xticks=[], yticks=[])
            ax.spines[:].set_visible(False)

        whole = figure.add_axes((0.03, 0.03, 0.50, 0.83))
        show(whole)
        whole.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5), anchor="W")
        name_colours(whole, (("circles found", FAR_PREDICTED), ("outline of the board", PREDICTED), ("touched", HAND)))
        for k, (u, v) in enumerate(poses.circles):
            ax = figure.add_axes((0.565 + 0.215 * (k % 2), 0.50 - 0.375 * (k // 2), 0.20, 0.335))
            show(ax)
            half = 0.5 * ZOOM
            ax.set(xlim=(u - half, u + half), ylim=(v + half, v - half))
            ax.text(
                0.03,
                0.95,
                f"({u:.2f}, {v:.2f}) px",
                transform=ax.transAxes,
                va="top",
                fontsize=10,
                color=INK,
                bbox={"facecolor": "white", "alpha": 0.8, "lw": 0, "pad": 2.0},
            )
        figure.text(0.03, 0.955, "Position of the board", fontsize=21, weight="bold", va="center")
        figure.text(0.03, 0.915, _pose_words(setup, summary), fontsize=11.5, color=SOFT_INK, va="center")
        figure.text(0.565, 0.868, "The four circles, enlarged", fontsize=13, weight="bold", va="center")
        words = (
            f"The centres of the circles fit the pose to {poses.rms:.2f} px rms. The arm touched three\n"
            "marks: rings show their nominal positions, crosses the positions of the tip."
        )
        figure.text(0.565, 0.085, words, fontsize=10.5, color=SOFT_INK, va="top")
        with replacing(path) as beside:
            figure.savefig(beside, dpi=150)


def _pose_words(setup: BallSetup, summary: Mapping[str, Any]) -> str:
    words = [f"scenario {setup.scenario.name}, seed {setup.scenario.seed}"]
    for key, name in (("board_in_camera_error", "camera"), ("board_in_world_error", "touch")):
        place, turn = summary[key]
        words.append(f"{name}: error of {1e3 * place:.1f} mm and {np.rad2deg(turn):.2f} deg")
    return "   ·   ".join(words)


def _on_face(xy: ArrayLike) -> np.ndarray:
    """Returns points on the face of the board in B [m], shape (n, 3), from their (x, y)_B, shape (n, 2)."""
    return np.column_stack([xy, np.zeros(len(np.asarray(xy)))])


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
            figure.savefig(beside, dpi=200, bbox_inches="tight", pad_inches=0.08)


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
