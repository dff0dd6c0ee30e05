"""The task of Allen et al. 1991: two cameras watch a model train, and an arm grasps it while it moves.

A scenario goes in. `resolve` computes a `TrainSetup` from it; `build` makes the hand-eye diagram of the set-up, and
`make_arm_side` and `make_host_side` make its two halves for two processes. After a run, its log goes into `summarise`,
which measures errors against ground truth. Begin with `scenario.py`, `setup.py` and `diagram.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
