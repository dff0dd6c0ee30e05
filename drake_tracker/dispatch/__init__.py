"""Dispatch decides which part the arm picks next from a moving belt.

Parts on the belt (`Candidate`), the hand (`Hand`) and the free cells (`Cell`) go in; a `Plan` comes out, the first pick
of which is binding. `CycleModel` predicts how long the arm takes, and `make_dispatcher` makes a dispatcher of its
settings: `LookAhead`, `Greedy`, `NearestDeadline` or `FirstInFirstOut`. All of it is arithmetic.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
