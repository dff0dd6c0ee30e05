"""Wiring of a hand-eye system from its subsystems.

The subsystems world, vision, host, link and arm go in, each a Drake System; out comes a `HandEyeDiagram` in which they
are connected. Begin with `hand_eye.py`. `parts.py` makes the arm, the estimator and the link that a scenario names,
including custom parts, for which `make_custom` calls a class or function of the user.

    world ──images──▶ vision ──point──▶ host ──prediction──▶ link ──delivered──▶ arm ──joint set-points──▶ world
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
