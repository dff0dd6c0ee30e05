"""Motion of the arm: servo, transform equation, inverse kinematics, and set-points of the joints.

A packet of predicted path and the motion that the hand should make go in; joint set-points come out every servo period.
Begin with `tool_controller.py`, which has the Systems of the transform equation and of the inverse kinematics and
connects them in their order; `servo.py` is the arithmetic before them, which follows the packets.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
