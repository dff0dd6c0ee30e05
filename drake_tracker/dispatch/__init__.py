"""Dispatch decides which part the arm picks next from a moving belt.

Parts on the belt (`Candidate`), the hand (`FreeHand`) and the free cells (`Cell`) go in; a `Plan` comes out, the first
pick of which is binding. Begin with `dispatcher.py`, the role and its registry: `make_dispatcher` makes a dispatcher of
its settings, `LookAhead`, `Greedy`, `NearestDeadline` or `FirstInFirstOut`. `CycleModel` predicts how long the arm
takes. `PickHostSystem` runs a dispatcher on the host; all else is arithmetic.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
