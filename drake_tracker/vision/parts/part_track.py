"""The track of a part on the belt, from its first images until the part is picked or leaves."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

from drake_tracker.core.part_kinds import PartKind
from drake_tracker.vision.parts.part_fit import PartFit
from drake_tracker.vision.parts.part_silhouette import PartPose


@dataclass(frozen=True, eq=False)
class PartTrack:
    """A part on the belt.

    Attributes:
        number: identity, 0 while the part is not yet confirmed.
        clear: whether its outline fits a known kind of part. An unclear object lies on the belt, but its kind is
            unknown: parts that touch and could not be separated, or something else.
        fit: place of the part, and its covariance.
        seen: stamp at which it was last seen [s].
        visible: stamp at which it was last seen or hidden [s]: where it should be, the belt was never seen empty since.
        images: number of pairs of images in which it was seen.
        rivals: {kind: where a part of this kind would be}, while the part is not yet confirmed; also its own kind.
        misfits: {kind: sum of the misfits}, of the same kinds.
    """

    number: int
    clear: bool
    fit: PartFit
    seen: float
    visible: float
    images: int
    rivals: Mapping[PartKind, PartFit]
    misfits: Mapping[PartKind, float]

    @property
    def pose(self) -> PartPose:
        """Where it is."""
        return self.fit.pose

    def moved(self, distance: float) -> Self:
        """Returns the track of a part that was not seen while the belt moved by a distance [m]."""
        return replace(
            self, fit=_moved(self.fit, distance), rivals={k: _moved(v, distance) for k, v in self.rivals.items()}
        )

    def found(self, fit: PartFit, stamp: float) -> Self:
        """Returns the track of a part whose kind is known, or not clear, after an image in which it was seen."""
        return replace(self, fit=fit, seen=stamp, visible=stamp, images=self.images + 1)

    def compared(self, rivals: Mapping[PartKind, PartFit], stamp: float) -> Self:
        """Returns the track of a part whose kind is not yet known, after an image in which it was seen.

        Args:
            rivals: {kind: where a part of this kind would be}, at least one.
            stamp: of the image [s].
        """
        misfits = {kind: self.misfits.get(kind, 0.0) + fit.misfit for kind, fit in rivals.items()}
        best = min(misfits, key=lambda kind: misfits[kind])
        return replace(
            self,
            fit=rivals[best],
            seen=stamp,
            visible=stamp,
            images=self.images + 1,
            rivals=rivals,
            misfits=misfits,
        )

    def confirmed(self, number: int) -> Self:
        """Returns the track with its number."""
        return replace(self, number=number, rivals={}, misfits={})


def _moved(fit: PartFit, distance: float) -> PartFit:
    pose = fit.pose
    return replace(fit, pose=replace(pose, y=pose.y + distance))
