"""Shared by all subsystems: the messages on the ports, timing, settings, registries, logs and errors.

Nothing of the other packages goes in. Out come the named views of all port messages (`Centroid` to `CatchVerdict`), the
periods and slots of the loop (`drake_tracker.core.timing`), `setting` and `Registry`, with which a part declares and
registers its settings, `Signal` with `save_log` and `load_log`, the base class of states in a Context (`FrozenState`),
and the exception that users catch (`DrakeTrackerError`). Begin with `messages.py` and `timing.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
