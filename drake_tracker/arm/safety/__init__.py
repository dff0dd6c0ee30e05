"""What protects the arm and those around it: packet guard, joint limiter, collision reflex.

Packets and joint set-points go in; those that the arm may follow come out. Begin with `packet_guard.py`, which checks
every packet before the arm uses it. `joint_limiter.py` is the last check of the set-points, and with
`collision_reflex.py` a drive that pushes against something with all its torque gives way.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
