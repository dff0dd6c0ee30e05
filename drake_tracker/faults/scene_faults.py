"""Faults of the scene: a panel before a camera, a second moving object, a hand over the belt."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from drake_tracker.faults.fault import EncoderFault, MovingBody, PointFault, SceneFault, Sight

THICKNESS = 0.01
"""Thickness of the panel [m]."""
PANEL_SHARE = 0.55
"""Place of the panel on the line from the middle of the table to the camera, as a fraction of its length."""
PARKED = 1.2
"""Distance above that place at which the panel waits, out of both images [m]."""
SWEEP = 0.6
"""Time in which it moves in front of the camera, and back [s]."""
MIDDLE = (0.56, 0.0, 0.47)
"""The middle of the table, at which the cameras look [m]."""
BOX = (0.04, 0.12, 0.05)
"""Size of the second mover [m]: that of the train, along y."""
SLOWEST_SEEN = 0.017
"""Speed below which the second mover is not seen [m/s], about that of the slowest train that measured vision sees."""
JOINED = 60.0
"""Distance [px] up to which the detector takes train and mover for one object: it joins regions that are 24 px apart,
and each reaches 17 px to its sides. In images of three runs, those up to 56 px apart were joined, and those from 63 px
on were not."""
HAND = (0.40, 0.09, 0.05)
"""Size of a hand with its forearm, which reaches over the belt along -x [m]."""
SKIN = (0.80, 0.58, 0.46, 1.0)
WITHDRAWN = 0.30
"""Distance from its place over the belt at which the hand waits [m]."""
CLEARANCE = 0.001
"""Gap between the second mover and the table [m]."""


@dataclass(frozen=True)
class PassingOccluderFault(SceneFault, PointFault):
    """`PassingOccluder`: a panel that faces the camera comes down in front of the camera, stays, and goes up again.

    Measured vision sees nothing while the line of sight to the point passes through the panel. It does not see the
    motion of the panel itself, which cameras do.

    Attributes:
        X_WCs: {side: true pose of the camera, (4, 4)}.
    """

    X_WCs: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def body(self) -> MovingBody:
        camera = np.asarray(self.X_WCs[self.settings.camera])
        X_WP = np.eye(4)
        X_WP[:3, :3] = camera[:3, :3]
        X_WP[:3, 3] = MIDDLE + PANEL_SHARE * (camera[:3, 3] - MIDDLE)
        return MovingBody(
            name=f"occluder_{self.number}",
            size=(self.settings.width, self.settings.height, THICKNESS),
            colour=(0.35, 0.30, 0.25, 1.0),
            X_WP=X_WP,
            axis=(0.0, -1.0, 0.0),
            travel=PARKED + 0.1,
        )

    def slide(self, time: float) -> tuple[float, float]:
        away, rate = _in_and_out(time, self.begin, self.end)
        return PARKED * away, PARKED * rate

    def blocks(self, time: float, origin: np.ndarray, p_WQ: np.ndarray) -> bool:
        """Returns whether the panel is on the line from a camera's centre (3,) to a point (3,) [m] in W."""
        body = self.body
        R_WP, place = body.X_WP[:3, :3], body.X_WP[:3, 3] + body.X_WP[:3, :3] @ body.axis * self.slide(time)[0]
        start, end = R_WP.T @ (origin - place), R_WP.T @ (p_WQ - place)
        if start[2] * end[2] >= 0.0:
            return False
        crossing = start + (end - start) * start[2] / (start[2] - end[2])
        return bool(np.all(np.abs(crossing[:2]) <= 0.5 * np.array(body.size[:2])))

    def centroid(self, sight: Sight) -> np.ndarray | None:
        if sight.p_WQ is not None and self.blocks(sight.time, sight.model.X_WC[:3, 3], sight.p_WQ):
            return None
        return sight.uv


@dataclass(frozen=True)
class SecondMoverFault(SceneFault, PointFault):
    """`SecondMover`: a box of the size of the train, which the motion detector cannot distinguish from the train.

    The mover goes to and fro in a sinusoid. With measured vision, a camera finds the common centroid of train and
    mover, each weighted by its area, if they are close to each other in the image. Otherwise it finds the centroid of
    the train, in which more pixels move. The mover does not count where it turns, while it is too slow to be seen.

    Attributes:
        table_height: height of the table's top [m].
    """

    table_height: float = 0.45

    def hits(self, camera: str) -> bool:
        return True

    @property
    def body(self) -> MovingBody:
        X_WP = np.eye(4)
        X_WP[:3, 3] = [*self.settings.place, self.table_height + 0.5 * BOX[2] + CLEARANCE]
        return MovingBody(
            name=f"second_mover_{self.number}",
            size=BOX,
            colour=(0.85, 0.80, 0.30, 1.0),
            X_WP=X_WP,
            axis=(0.0, 1.0, 0.0),
            travel=self.settings.amplitude + 0.05,
            mass=0.25,
            force=3.0,
            solid=True,
        )

    def slide(self, time: float) -> tuple[float, float]:
        amplitude, rate = self.settings.amplitude, self.settings.speed / self.settings.amplitude
        if time < self.begin:
            return 0.0, 0.0
        phase = rate * (min(time, self.end) - self.begin)
        moving = 1.0 if time < self.end else 0.0
        return amplitude * math.sin(phase), moving * self.settings.speed * math.cos(phase)

    def centroid(self, sight: Sight) -> np.ndarray | None:
        y, speed = self.slide(sight.time)
        if abs(speed) < SLOWEST_SEEN:
            return sight.uv
        p_WM = np.array([*self.settings.place, self.table_height + 0.5 * BOX[2]]) + [0.0, y, 0.0]
        uv = sight.model.project(p_WM)[0]
        if sight.uv is None or sight.p_WQ is None:
            return uv
        if np.hypot(*(uv - sight.uv)) > JOINED:
            return sight.uv
        centre = sight.model.X_WC[:3, 3]
        near, far = (1.0 / float(np.sum((p - centre) ** 2)) for p in (sight.p_WQ, p_WM))
        return (near * sight.uv + far * uv) / (near + far)


@dataclass(frozen=True)
class HandOverBeltFault(SceneFault):
    """`HandOverBelt`: a hand comes in over the far edge of the belt, stays, and goes back.

    It touches nothing: the arm would pass through it. Only what the cameras see of it matters.

    Attributes:
        belt_middle: x of the middle of the belt in W [m].
        belt_height: height of its upper face in W [m].
    """

    belt_middle: float = 0.60
    belt_height: float = 0.45

    @property
    def body(self) -> MovingBody:
        X_WP = np.eye(4)
        x = self.belt_middle - self.settings.reach + 0.5 * HAND[0]
        X_WP[:3, 3] = [x, self.settings.y, self.belt_height + self.settings.height + 0.5 * HAND[2]]
        return MovingBody(
            name=f"hand_{self.number}",
            size=HAND,
            colour=SKIN,
            X_WP=X_WP,
            axis=(1.0, 0.0, 0.0),
            travel=WITHDRAWN + 0.1,
        )

    def slide(self, time: float) -> tuple[float, float]:
        away, rate = _in_and_out(time, self.begin, self.end)
        return WITHDRAWN * away, WITHDRAWN * rate


def _in_and_out(time: float, begin: float, end: float) -> tuple[float, float]:
    """Returns how far a body is away from its place, from 0 to 1, and the rate of this [1/s].

    It comes within `SWEEP` from the beginning on, and is away again at the end.
    """
    inwards = min(time - begin, end - time) / SWEEP
    share = min(max(inwards, 0.0), 1.0)
    rate = 0.0
    if 0.0 < inwards < 1.0:
        middle = math.inf if math.isinf(end) else 0.5 * (begin + end)
        rate = math.copysign(0.5 * math.pi * math.sin(math.pi * share) / SWEEP, middle - time)
    return 0.5 * (1.0 + math.cos(math.pi * share)), -rate


@dataclass(frozen=True)
class EncoderJumpFault(EncoderFault):
    """`EncoderJump`: a constant is added to the distance."""

    def travelled(self, time: float, distance: Callable[[float], float]) -> float:
        return distance(time) + self.settings.distance


@dataclass(frozen=True)
class EncoderStoppedFault(EncoderFault):
    """`EncoderStopped`: the distance stays that at the beginning of the fault."""

    def travelled(self, time: float, distance: Callable[[float], float]) -> float:
        return distance(self.begin)
