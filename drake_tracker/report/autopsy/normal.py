"""What is normal: the most that each stage, in the order of `Stage`, contributed in runs that went well, rounded up.

Printed by ``benchmarks/autopsy.py --faults none,none-rendered --first-seed 0 --seeds 5 --normal``: the default scenario
with measured vision and with cameras. Zeros are made a tenth of a millimetre.
"""

NORMAL_ATTEMPT = (0.010, 0.0002, 0.0001, 0.007, 0.0001, 0.006, 0.001)
"""Length of the contribution [m] to the offset at the closing of the jaws."""
NORMAL_TRACKING = (0.016, 0.0002, 0.0001, 0.014, 0.0001, 0.008, 0.0001)
"""Length [m] within which 68 of 100 are over the time of tracking."""
