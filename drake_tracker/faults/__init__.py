"""Faults: what goes wrong in a run, and when.

A scenario lists them under ``faults``. Each acts on the laboratory or on a wire between subsystems, never on the
controller, which must notice by itself. `config` has the settings of every kind, `kinds` the registry, and `fault` a
base class for each place where a fault acts.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
