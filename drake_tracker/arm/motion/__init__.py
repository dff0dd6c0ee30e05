"""Motion of the arm: servo, transform equation, inverse kinematics, and set-points of the joints.

A packet of predicted path and the motion that the hand should make go in; joint set-points come out every 30 ms. Begin
with `tool_controller.py`, which connects the Systems in their order.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
