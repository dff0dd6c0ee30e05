"""Parts of estimators: filters, models of motion, and changes of speed.

Points and states go in; filtered states and predicted rows come out. Each module has one piece of arithmetic with its
source, and none is an estimator by itself. Begin with the estimator that uses a part: `arc_length.py` uses `arc`,
`helix`, `kaiser` and `rice`; `coordinated_turn.py` uses `turn_filter`; `closed_path.py` uses `path_follower`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
