"""Files that survive any end of the process: YAML, npz, MCAP and text, written whole or not at all.

Data goes in and files come out, or the reverse; an unreadable file raises a `DrakeTrackerError` that names it. Begin
with `atomic_file.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
