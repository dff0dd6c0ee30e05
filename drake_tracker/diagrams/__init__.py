"""Wiring of a hand-eye system from its subsystems.

The subsystems world, vision, host, link and arm go in, each a Drake System; out comes a `HandEyeDiagram` in which they
are connected. `estimator_of` and `arm_of` make the parts that a scenario names, including custom parts, for which
`make_custom` calls a class or function of the user.

    world ──images──▶ vision ──point──▶ host ──prediction──▶ link ──delivered──▶ arm ──joint set-points──▶ world
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
