"""The events of a run of the train, from its log.

The scenario and the log of a run go in; attempts, failures and their causes come out, for the summary and the page of
the run. Begin with `failure.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
