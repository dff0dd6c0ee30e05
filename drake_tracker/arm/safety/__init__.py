"""Protection of the arm and of its surroundings: packet guard, joint limiter, collision reflex.

Inputs are packets and joint set-points; outputs are the packets and set-points that the arm may follow. Begin with
`packet_guard.py`, which checks every packet before the arm uses it. `joint_limiter.py` is the last check of the
set-points, and with `collision_reflex.py` a drive that pushes against something with all its torque gives way.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
