"""Constants of nature that more than one room reckons with."""

GRAVITY = 9.81
"""[m/s^2] along -z_W, as the simulated plant has it."""
