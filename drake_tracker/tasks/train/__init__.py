"""The task of Allen et al. 1991: two cameras watch a model train, and an arm grasps it while it moves.

A `TrainScenario` goes in; `make_train_diagram` makes its hand-eye diagram, and `make_arm_side` and `make_host_side` the
same in two processes. After a run, its log goes into `summarise`, which measures errors against ground truth, and
`failure_reason`, which says in one sentence why a train was not lifted.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
