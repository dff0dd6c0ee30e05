"""Injected faults of a run, with their times.

The settings that a scenario lists under ``faults`` go in; `Fault` objects come out. Each acts on the laboratory or on a
wire between subsystems, never on the controller, which must notice by itself. Begin with `fault.py`, which has a base
class for each place where a fault acts; `config` has the settings of every kind, and `kinds` the registry.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
