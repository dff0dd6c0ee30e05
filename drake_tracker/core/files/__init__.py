"""Reading and writing files: whole or not at all, and without trust in what is read.

Data goes in and files come out, or the reverse: text and npz archives, YAML and MCAP. `atomic_file.py`, with which to
begin, writes a file so that any end of the process leaves the old one or the new one. The others limit the size and the
kind of what they read.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
