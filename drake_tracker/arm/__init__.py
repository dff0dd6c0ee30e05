"""The arm: from packets of predicted path to joint set-points.

Inputs are packets of predicted path (`Prediction`), the measured joints and the command for the hand (`ArmCommand`,
from a System of `drake_tracker.grasp`). Outputs are the desired joint state, feedforward torques and jaw set-points.
Begin with `arm_diagram.py`, which connects the parts of `motion` and `safety`. `ArmDescription` says which models an
arm and its hand consist of, and `ARMS` registers the arms that exist.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
