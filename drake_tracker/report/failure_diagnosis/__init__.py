"""The autopsy of a run of the train: the outcome of each attempt, and the stage that caused a failure.

The scenario and the log of a run go in; `perform` returns a dict with the culprit, the attempts, and the contribution
of each stage. All of it is arithmetic on the log.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
