"""Reasons to doubt a track: other objects nearby, motion of the camera, changes of the object."""

from collections.abc import Sequence
from typing import Any

from drake_tracker.vision.image_tracks.image_objects import ImageObjects

MARKS = ("camera moves", "large rival", "other object", "leap")
"""Kinds of trouble, in the order of the counts of `TrackQuality`."""


class TrackQuality:
    """Counts, image by image, the reasons to doubt a track.

    Attributes:
        images: number of images.
        moved: number of those in which a camera itself moved.
        rivals: number of those in which another object was as large as the one followed.
        switches: number of times another object took the place of one that was lost, in all cameras.
        leaps: number of times an object was found again farther away than it can have moved.
        marks: stamps of the images with each kind of trouble [s].
    """

    def __init__(self) -> None:
        self.images = self.moved = self.rivals = self.switches = self.leaps = 0
        self.marks: dict[str, list[float]] = {kind: [] for kind in MARKS}

    def add(self, stamp: float, objects: Sequence[ImageObjects | None]) -> None:
        """Counts an image.

        Args:
            stamp: of the image [s].
            objects: in the view of each camera.
        """
        counts = (self.moved, self.rivals, self.switches, self.leaps)
        known = [each for each in objects if each is not None]
        self.images += 1
        self.moved += any(each.displacement > 0.0 for each in known)
        self.rivals += any(each.rivals > 0 for each in known)
        if known:
            self.switches = max(self.switches, sum(each.switches for each in known))
            self.leaps = max(self.leaps, sum(each.leaps for each in known))
        for kind, before, now in zip(MARKS, counts, (self.moved, self.rivals, self.switches, self.leaps)):
            if now > before:
                self.marks[kind].append(stamp)

    def summary(self) -> dict[str, Any]:
        """Returns the counts for the summary."""
        return {
            "images_with_camera_motion": self.moved,
            "images_with_rivals": self.rivals,
            "object_changes": self.switches,
            "leaps": self.leaps,
        }


def doubts(summary: dict[str, Any]) -> str | None:
    """Returns one line on what may be wrong with a track, None when nothing is known.

    Args:
        summary: of the track.
    """
    hidden = summary.get("states", {}).get("hidden", 0)
    hint = "" if summary.get("follow") or summary.get("roi") else " (--follow, --roi)"
    parts = [
        words.format(count=count, noun=noun if count == 1 else f"{noun}s")
        for count, noun, words in (
            (summary.get("images_with_camera_motion"), "image", "the camera moved in {count} {noun} (compensated)"),
            (
                summary.get("images_with_rivals"),
                "image",
                f"another moving object was about as large, or larger, in {{count}} {{noun}}{hint}",
            ),
            (
                summary.get("object_changes"),
                "time",
                "the track changed to another object {count} {noun} (column id)",
            ),
            (summary.get("leaps"), "time", "the object leapt {count} {noun}"),
            (hidden, "row", "an object was hidden in {count} {noun}"),
            (
                summary.get("off_plane") if summary.get("results") else 0,  # else the command says so by itself
                "row",
                "an object was seen in {count} {noun} where the camera does not see the plane",
            ),
        )
        if count
    ]
    return f"Note: {'; '.join(parts)}." if parts else None
