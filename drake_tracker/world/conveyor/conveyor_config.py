"""Settings of the simulated conveyor: the belt, the parts that it brings, and the trays."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drake_tracker.core.belt_frame import BeltFrame
from drake_tracker.core.setting import setting

BELT_MOTIONS = ("running", "stop_and_go", "two_speed")
ARRIVAL_PATTERNS = ("poisson", "bunches", "even")
SIDES = (1.0, -1.0)
"""Sides of the x axis on which the two trays lie."""


@dataclass(frozen=True)
class BeltConfig:
    """The belt: where it lies, and how it moves. It carries the parts along +y of the world.

    It starts from rest at time 0. The controller knows where it lies, but not how it moves.
    """

    speed: float = setting(0.15, "speed of the belt", "m/s", (0.05, 0.4))
    motion: str = setting(
        "running",
        "running: always at speed; stop_and_go: at speed, then at rest, and so on; two_speed: at speed, then at "
        "second_speed, and so on",
        choices=BELT_MOTIONS,
    )
    first_duration: ClassVar[float] = 6.0
    """For stop_and_go and two_speed: time at speed before each change [s]; chosen."""
    second_duration: ClassVar[float] = 2.0
    """For stop_and_go and two_speed: time at rest or at second_speed [s]; chosen."""
    second_speed: ClassVar[float] = 0.25
    """For two_speed: the other speed [m/s]; chosen."""
    acceleration: float = setting(0.5, "acceleration from one speed to another", "m/s^2", (0.05, 3.0))
    middle: float = setting(0.60, "x of the middle of the belt", "m", (0.3, 1.0))
    width: float = setting(0.24, "width of the belt", "m", (0.1, 0.5))
    height: float = setting(0.45, "height of the upper face of the belt", "m", (0.3, 0.8))
    incline_deg: float = setting(
        0.0, "angle by which the belt rises along y; its height is that at y = 0", "deg", (0.0, 10.0)
    )
    entry: float = setting(-0.45, "y at which a part arrives", "m", (-1.0, 0.0))
    end: float = setting(0.50, "y at which a part that is still on the belt is missed", "m", (0.0, 1.0))
    encoder: bool = setting(False, "whether an encoder measures the distance that the belt has travelled")

    @property
    def frame(self) -> BeltFrame:
        """The frame in which the belt is level."""
        return BeltFrame(math.radians(self.incline_deg), self.height)


@dataclass(frozen=True)
class ArrivalsConfig:
    """The parts that the belt brings. When, which and how they lie is drawn from the seed."""

    rate: float = setting(12.0, "mean number of parts that arrive", "1/min", (0.5, 60.0))
    pattern: str = setting(
        "poisson",
        "whether parts arrive independently of each other, in bunches, or evenly, as from a feeder",
        choices=ARRIVAL_PATTERNS,
    )
    bunch_size: float = setting(3.0, "for bunches: mean number of parts in a bunch", "", (1.0, 20.0))
    variation: float = setting(
        0.3, "for even: largest deviation of a space between parts from the mean space, as a share", "", (0.0, 1.0)
    )
    mix: ClassVar[tuple[float, ...]] = (1.0, 1.0, 1.0)
    """How often boxes, discs and ells come, relative to each other; chosen."""
    gap: float = setting(0.015, "smallest distance along the belt between parts that do not touch", "m", (0.005, 0.5))
    touching: float = setting(0.0, "share of the parts that touch the part before them", "", (0.0, 0.9))
    lateral: float = setting(0.05, "largest distance of a part from the middle of the belt", "m", (0.0, 0.2))
    lying: float = setting(0.0, "share of the boxes on end, and of the ells on an edge", "", (0.0, 0.9))


@dataclass(frozen=True)
class TrayConfig:
    """The two trays, which lie between the arm and the belt, one on each side of the arm.

    A tray is a grid of square cells with their floors at the height of the belt's upper face. Columns run along x, away
    from the arm; rows run along y, away from the arm's middle.
    """

    columns: int = setting(2, "columns of a tray", "", (1, 6))
    rows: int = setting(6, "rows of a tray", "", (1, 12))
    pitch: ClassVar[float] = 0.065
    """Distance between the centres of neighbouring cells [m]; chosen."""
    cell: float = setting(0.062, "side of a cell between its walls", "m", (0.04, 0.2))
    wall_height: ClassVar[float] = 0.004
    """Height of the walls above the floors of the cells [m]; chosen."""
    first_cell: ClassVar[tuple[float, ...]] = (0.345, 0.19)
    """X and distance from the x axis of the centre of the cell in the first column and row [m]; chosen."""


def cell_centres(tray: TrayConfig) -> np.ndarray:
    """Returns the (x, y) of the centres of all cells in W, shape (n, 2) [m].

    Cells are numbered from the first tray (y > 0) to the second, in each from the first row outwards, and in each row
    away from the arm.
    """
    x, y = tray.first_cell
    return np.array(
        [
            [x + column * tray.pitch, side * (y + row * tray.pitch)]
            for side in SIDES
            for row in range(tray.rows)
            for column in range(tray.columns)
        ]
    )


def cell_at(tray: TrayConfig, x: float, y: float) -> int | None:
    """Returns the number of the cell that is below or above a point of W [m]; None outside of all cells."""
    distance = np.abs(cell_centres(tray) - [x, y]).max(axis=1)
    nearest = int(np.argmin(distance))
    return nearest if distance[nearest] <= 0.5 * tray.cell else None
