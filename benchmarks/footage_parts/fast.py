"""A small fast ball with a large slow mover in view, followed by the whole of `drake-tracker track --follow`, for
`footage.py`."""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from footage_parts.clips import FAST_KINDS, RATE, make_clip

from drake_tracker.own_cameras import make_track, prepare_track

CELLS = FAST_KINDS


def tracked(clip, **options):
    """Returns (number of the image, place (u, v) [px], whether it is valid, identity) of each row of a track, arrays.

    Args:
        clip: `Clip` to track.
        options: of `prepare_track`.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "images").mkdir()
        for k, image in enumerate(clip.images):
            cv2.imwrite(str(folder / "images" / f"{k:04d}.png"), image)
        (folder / "out").mkdir()
        make_track(prepare_track([str(folder / "images")], fps=RATE, **options), folder / "out", overlay=False)
        table = np.genfromtxt(folder / "out" / "track.csv", delimiter=",", names=True)
    numbers = np.rint(table["stamp"] * RATE).astype(int)
    return numbers, np.column_stack([table["u"], table["v"]]), table["valid"] == 1, table["id"]


def job(cell, seed, quick):
    """Returns the line of a clip, as `footage.job` does: errors [px], and the number of images without a place."""
    clip = make_clip(cell, seed)
    numbers, places, seen, _ = tracked(clip, follow=["{:.0f},{:.0f}".format(*clip.truth[0, 0])])
    errors = np.hypot(*(places - clip.truth[numbers, 0]).T)
    return {"errors_px": errors[seen].tolist(), "missed": int((~seen).sum()), "size_px": clip.size, "kept": None}
