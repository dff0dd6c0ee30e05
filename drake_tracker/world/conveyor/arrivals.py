"""When parts arrive on the belt, which they are, and how they lie."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind, placed_outline, touching_distance
from drake_tracker.world.conveyor.belt_motion import BeltMotion
from drake_tracker.world.conveyor.conveyor_config import ARRIVAL_PATTERNS, ArrivalsConfig, BeltConfig

STREAM, LYING_STREAM = 101, 102
"""The streams of random numbers of the arrivals, default_rng([seed, STREAM]), and of whether they lie on a side."""
KINDS = (PartKind.BOX, PartKind.DISC, PartKind.ELL)
"""The kinds in the order of ``arrivals.mix``."""
PART_COLOURS = ("#e8c33a", "#d8573c", "#3f8fd0", "#e9e4d6")
"""Colours of the parts, as "#rrggbb"."""
TOUCH = 0.0003
"""Distance between parts that touch, so that they do not push each other before they move [m]."""
BESIDE = 0.012
"""Largest distance across the belt between the middles of two parts that touch [m]."""
NEIGHBOURS = 3
"""Number of parts before it that a part could touch."""
WITHIN_BUNCH = 0.04
"""Mean distance along the belt between parts of a bunch, beyond the smallest one [m]."""


@dataclass(frozen=True)
class Arrival:
    """A part that the belt brings.

    Attributes:
        time: at which the origin of its frame P passes the entry of the belt [s].
        kind: of the part.
        colour: as "#rrggbb".
        x: of the origin of P in W [m].
        yaw: direction of x_P in W, before a part that lies on a side was tipped over [rad].
        lies: whether a box stands on end, or an ell lies on the outer edge of its long leg.
    """

    time: float
    kind: PartKind
    colour: str
    x: float
    yaw: float
    lies: bool = False


def draw_arrivals(
    arrivals: ArrivalsConfig, *, belt: BeltConfig, motion: BeltMotion, duration: float, seed: int
) -> tuple[Arrival, ...]:
    """Returns the parts that arrive during a run, in the order of their arrival.

    Their distance along the belt is random, so that no part arrives while the belt is at rest. The rate holds at the
    mean speed of the belt. Parts that do not touch on purpose are at least ``gap`` apart, whatever their orientation.

    Args:
        arrivals: how many parts come, which, and how.
        belt: where the belt lies.
        motion: of the belt.
        duration: of the run [s].
        seed: of the random draws.

    Raises DrakeTrackerError when the pattern is unknown, when no kind of part comes, or when so many parts do not fit
    on the belt.
    """
    if arrivals.pattern not in ARRIVAL_PATTERNS:
        raise DrakeTrackerError(
            f"arrivals.pattern is {arrivals.pattern!r}; it must be one of {', '.join(ARRIVAL_PATTERNS)}"
        )
    shares = np.array(arrivals.mix, dtype=float)
    if not shares.sum() > 0.0:
        raise DrakeTrackerError("arrivals.mix is 0 for all kinds; one at least must be positive")
    shares = shares / shares.sum()
    within, between = _mean_spaces(arrivals, shares, motion.mean_speed)
    rng, tips = (np.random.default_rng([seed, stream]) for stream in (STREAM, LYING_STREAM))
    parts: list[Arrival] = []
    travelled, radius_before = 0.0, 0.0
    outlines: list[np.ndarray] = []
    while True:
        kind = KINDS[rng.choice(len(KINDS), p=shares)]
        colour = PART_COLOURS[rng.integers(len(PART_COLOURS))]
        across, yaw = rng.uniform(-1.0, 1.0), rng.uniform(-np.pi, np.pi)
        touches, begins, space = rng.random(), rng.random(), rng.exponential()
        radius = PART_SHAPES[kind].radius
        if parts and touches < arrivals.touching:
            near = np.clip(parts[-1].x - belt.middle + BESIDE * across, -arrivals.lateral, arrivals.lateral)
            x = belt.middle + float(near)
            outline = placed_outline(kind, x, 0.0, yaw)
            travelled = max(touching_distance(ahead, outline) for ahead in outlines[-NEIGHBOURS:]) + TOUCH
        else:
            x = belt.middle + arrivals.lateral * across
            bunched = arrivals.pattern == "bunches" and begins > 1.0 / arrivals.bunch_size
            if arrivals.pattern == "even":
                space = 1.0 + arrivals.variation * (2.0 * begins - 1.0)
            smallest = radius_before + radius + arrivals.gap if parts else 0.0
            travelled += smallest + space * (within if bunched else between)
        time = motion.time_at(travelled)
        if time > duration:
            return tuple(parts)
        lies = tips.random() < arrivals.lying and kind is not PartKind.DISC
        parts.append(Arrival(time, kind, colour, x, yaw, lies))
        outlines.append(placed_outline(kind, x, -travelled, yaw))
        radius_before = radius


def _mean_spaces(arrivals: ArrivalsConfig, shares: np.ndarray, speed: float) -> tuple[float, float]:
    """Returns the mean space [m] along the belt beyond the smallest one, within a bunch and between two bunches."""
    radius = float(shares @ [PART_SHAPES[kind].radius for kind in KINDS])
    wanted = 60.0 * speed / arrivals.rate
    # Parts that touch are a little less than the sum of their radii apart.
    smallest = 2.0 * radius + (1.0 - arrivals.touching) * arrivals.gap
    space = (wanted - smallest) / max(1.0 - arrivals.touching, 1e-9)
    size = arrivals.bunch_size if arrivals.pattern == "bunches" else 1.0
    between = size * space - (size - 1.0) * WITHIN_BUNCH
    if space <= 0.0 or between <= 0.0:
        most = 60.0 * speed / (smallest + (WITHIN_BUNCH if size > 1.0 else 0.0))
        raise DrakeTrackerError(
            f"arrivals.rate is {arrivals.rate:g} 1/min; at a mean speed of the belt of {speed:g} m/s no more than "
            f"{most:.1f} 1/min fit with these gaps"
        )
    return WITHIN_BUNCH, between
