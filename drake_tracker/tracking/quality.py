"""What may make a track wrong: other objects nearby, motion of the camera, changes of the object."""

from collections.abc import Sequence
from typing import Any

from drake_tracker.vision.image_tracker import ImageObjects


class TrackQuality:
    """Counts, image by image, what makes a track doubtful.

    Attributes:
        images: number of images.
        moved: number of those in which a camera itself moved.
        rivals: number of those in which another object was as large as the one followed.
        switches: number of times another object took the place of one that was lost, in all cameras.
    """

    def __init__(self) -> None:
        self.images = self.moved = self.rivals = self.switches = 0

    def add(self, objects: Sequence[ImageObjects | None]) -> None:
        """Counts an image, given the objects in the view of each camera."""
        known = [each for each in objects if each is not None]
        self.images += 1
        self.moved += any(each.displacement > 0.0 for each in known)
        self.rivals += any(each.rivals > 0 for each in known)
        if known:
            self.switches = max(self.switches, sum(each.switches for each in known))

    def summary(self) -> dict[str, Any]:
        """Returns the counts for the summary."""
        return {
            "images_with_camera_motion": self.moved,
            "images_with_rivals": self.rivals,
            "object_changes": self.switches,
        }


def doubts(summary: dict[str, Any]) -> str | None:
    """Returns one line on what may be wrong with a track, None when nothing is known.

    Args:
        summary: of the track.
    """
    parts = []
    if summary.get("images_with_camera_motion"):
        parts.append(f"the camera moved in {summary['images_with_camera_motion']} images (compensated)")
    if summary.get("images_with_rivals"):
        parts.append(
            f"another moving object was about as large in {summary['images_with_rivals']} images (--follow, --roi)"
        )
    if summary.get("object_changes"):
        parts.append(f"the track changed to another object {summary['object_changes']} times (column id)")
    hidden = summary.get("states", {}).get("hidden", 0)
    if hidden:
        parts.append(f"an object was hidden in {hidden} rows")
    return f"Note: {'; '.join(parts)}." if parts else None
