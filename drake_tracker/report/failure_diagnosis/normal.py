"""Normal contributions: the largest of each stage, in the order of `Stage`, in runs that succeeded, rounded up.

Printed by ``benchmarks/autopsy.py --faults none,none-rendered --first-seed 0 --seeds 5 --normal``: `train:learned`
with measured vision and with cameras. Zeros are set to a tenth of a millimetre.
"""

NORMAL_ATTEMPT = (0.010, 0.0002, 0.0001, 0.007, 0.0001, 0.006, 0.001)
"""Length of the contribution [m] to the offset when the jaws close."""
NORMAL_TRACKING = (0.016, 0.0002, 0.0001, 0.014, 0.0001, 0.008, 0.0001)
"""68th percentile of the lengths [m] while tracking."""
