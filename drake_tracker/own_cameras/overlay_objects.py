"""Draws the objects of an image with their numbers, and says what makes a track doubtful."""

import cv2
import numpy as np

from drake_tracker.tasks.style import bgr, draw_text
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.reidentification import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.track_2d import TrackState

COLOURS = ("#4cc2ff", "#7ee081", "#ff8fa3", "#c9a2ff", "#ffd166")
"""Colours of objects that are reported, by their number."""
OTHER = "#a3abb5"
"""Colour of all others."""
PATH = "#4cc2ff"
"""Colour of the path of a single object."""
SHOWN = 0.5
"""Time for which a leap is written into the video [s]."""


def colour_of(number: int | None) -> str:
    """Returns the colour of an object that is reported: by its number, or `PATH` if there is only one."""
    return PATH if number is None else COLOURS[number % len(COLOURS)]


def draw_objects(view: np.ndarray, objects: ImageObjects, scale: float) -> list[str]:
    """Draws a rectangle with number and state round each confirmed object, in place; returns what to note.

    An object whose number is negative has no partner in the other image, and gets a question mark.

    Args:
        view: BGR image.
        objects: of the image.
        scale: pixels of the view per pixel of the image.
    """
    for track in objects.tracks:
        if track.hits < CONFIRM_AFTER:
            continue
        chosen = track.number in objects.targets
        colour = colour_of(track.number) if chosen else OTHER
        half = 0.5 * np.array([track.width, track.height])
        corners = [tuple(int(x) for x in np.rint(scale * (track.mean[:2] + sign * half))) for sign in (-1, 1)]
        cv2.rectangle(view, corners[0], corners[1], bgr(colour), 2 if chosen else 1, cv2.LINE_AA)
        state = "" if track.state == TrackState.MOVING else f" {track.state.name.lower()}"
        name = str(track.number) if track.number > 0 else "?"
        draw_text(view, f"{name}{state}", corners[0][0], corners[0][1] - 4, 13, colour, bold=chosen)
    notes = []
    if objects.displacement > 0.0:
        notes.append(f"camera moves {objects.displacement:.1f} px")
    if objects.leaps and max((track.stamp for track in objects.tracks), default=0.0) - objects.leapt < SHOWN:
        notes.append("leap")
    if objects.rivals:
        notes.append("other large object")
    return notes


def is_hidden(objects: ImageObjects, place: int = 0) -> bool:
    """Returns whether the object of a place among those that are reported is hidden."""
    track = objects.target(place)
    return track is not None and track.state == TrackState.HIDDEN
