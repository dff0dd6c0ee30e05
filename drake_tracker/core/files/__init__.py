"""Reading and writing files: a file is written completely or not at all, and the content of a read file is not trusted.

Data goes in and files come out, or the reverse: text and npz archives, YAML and MCAP. `atomic_file.py`, with which to
begin, writes a file so that any end of the process leaves the old one or the new one. The other modules limit the size
and the kind of the files that they read.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
