"""Where the cells of the trays are."""

import numpy as np

from drake_tracker.world.conveyor.conveyor_config import TrayConfig

SIDES = (1.0, -1.0)
"""Sides of the x axis on which the two trays lie."""


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
