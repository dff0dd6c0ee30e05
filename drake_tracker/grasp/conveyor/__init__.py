"""Picking parts from the belt and placing them into cells.

The order of the dispatcher and the state of hand and jaws go in; the next motion comes out. Begin with
`pick_schema.py`, the table of phases, then `pick_machine.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
