"""The grasp of the train: its schema, and the machine that follows it.

The estimated object and the state of hand and jaws go in; the next motion comes out. Begin with `schema.py`, the table
of phases, then `grasp_machine.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
