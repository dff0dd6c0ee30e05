"""What estimators are made of: filters, models of motion, and changes of speed.

Nothing here is an estimator by itself; the modules of `drake_tracker.estimation` combine these parts. Each module has
one piece of arithmetic with its source.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
