"""Constants that more than one subsystem uses."""

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2] along -z_W, as in the simulated plant."""
SIDES = ("left", "right")
"""Names of the two cameras of a pair, with which the names of their ports end."""
