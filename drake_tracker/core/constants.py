"""Physical constants that more than one subsystem uses."""

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2] along -z_W, as in the simulated plant."""
