"""Prints the measured error of the vision as tables."""

from collections.abc import Mapping

import numpy as np

from drake_tracker.measured.measured_error import AXES
from drake_tracker.measured.measured_error_fit import HEADINGS, SpeedFit

_SHOWN = 12
"""Number of headings in the table of the bias."""
_BEND_RADIUS = 0.12
"""Radius of the tightest bends in which the train is grasped [m]."""


def print_fits(fits: Mapping[float, SpeedFit]) -> None:
    """Prints the fits at several speeds: residual and drop-outs against speed, bias against heading.

    Args:
        fits: {speed [m/s]: SpeedFit}.
    """
    print("error minus bias along, across, vertical: standard deviation; autocorrelation 1, 2, 5 cycles later;")
    print("fraction of the variance that repeats at the same place; fraction of cycles without a point")
    for speed, fit in fits.items():
        std = ", ".join(f"{1e3 * x:.2f}" for x in fit.std)
        later = "  ".join(", ".join(f"{x:+.2f}" for x in fit.correlation[lag]) for lag in (1, 2, 5))
        again = ", ".join(f"{x:.2f}" for x in fit.returns)
        print(f"{speed:5.2f} m/s  {std} mm  {later}  {again}  missing {fit.missing[0]:.1%}  {fit.points} points")
    middle = sorted(fits)[len(fits) // 2]
    table = 1e3 * fits[middle].bias[:, :: HEADINGS // _SHOWN]
    print(f"bias at {middle:g} m/s against heading, {', '.join(AXES)} [mm]: straight; bending left, right by 6 1/m")
    for k in range(_SHOWN):
        parts = [table[0, k] + bend * table[1, k] for bend in (0.0, 6.0, -6.0)]
        shown = "   ".join(", ".join(f"{x:+5.1f}" for x in part) for part in parts)
        print(f"{k * 360 // _SHOWN:4d} deg  {shown}")
    print(f"bias over all headings, rms (mean) [mm]: {', '.join(AXES)}; inwards in a bend of {_BEND_RADIUS:g} m")
    for speed, fit in sorted(fits.items()):
        rms, mean = bias_over_headings(fit.bias)
        print(f"{speed:5.2f} m/s  " + "  ".join(f"{1e3 * a:.1f} ({1e3 * b:+.1f})" for a, b in zip(rms, mean)))


def bias_over_headings(bias: np.ndarray, radius: float = _BEND_RADIUS) -> tuple[np.ndarray, np.ndarray]:
    """Returns the (root mean square, mean) of a bias over all headings, each of shape (4,) [m].

    The four numbers are the bias along, across and vertical on a straight path, and across, inwards positive, in bends
    to either side.

    Args:
        bias: of a `SpeedFit`, shape (2, h, 3).
        radius: of the bends [m].
    """
    straight, per_curvature = bias[0], bias[1, :, 1] / radius
    inwards = np.concatenate([straight[:, 1] + per_curvature, per_curvature - straight[:, 1]])
    parts = [*straight.T, inwards]
    return np.array([np.sqrt(np.mean(part**2)) for part in parts]), np.array([np.mean(part) for part in parts])
