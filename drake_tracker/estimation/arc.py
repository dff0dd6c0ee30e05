"""The circular arc that the arc-length filter fits to the newest points, and its run into the future."""

import math
from typing import NamedTuple

import numpy as np

from drake_tracker.estimation.delta_transform import delta_power


class Arc(NamedTuple):
    """A chord frame and the T_delta that runs from it.

    anchor (3,) [m, W], time [s], chord_heading [rad]: the chord frame.  s_0 [m], phi_0 [rad], dz [m]: T_delta of one
    baseline of ``baseline`` frames.  heading [rad]: direction of travel at the newest point, held while at rest.
    """

    anchor: tuple = (0.0, 0.0, 0.0)
    time: float = 0.0
    chord_heading: float = 0.0
    s_0: float = 0.0
    phi_0: float = 0.0
    dz: float = 0.0
    baseline: int = 1
    heading: float = 0.0


def run_arc(arc, times, period):
    """Returns the rows x, y, z, yaw of an `Arc` at ``times`` [s], shape (n, 4)."""
    n = (times - arc.time) / (arc.baseline * period)
    position, turn = delta_power(arc.s_0, arc.phi_0, n)
    position = position * complex(math.cos(arc.chord_heading), math.sin(arc.chord_heading))
    x, y, z = arc.anchor
    rows = np.empty((len(times), 4))
    rows[:, 0] = x + position.real
    rows[:, 1] = y + position.imag
    rows[:, 2] = z + n * arc.dz
    rows[:, 3] = arc.chord_heading + 0.5 * arc.phi_0 + turn
    return rows
