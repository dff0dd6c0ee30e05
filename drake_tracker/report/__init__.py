"""The page of a finished run, and the small server that shows it.

A run directory goes in (`read_run`); a text of HTML comes out (`page_of`), with recording, video, phases, the autopsy
of the attempts, pictures and the numbers of the summary. `make_server` serves it to this machine only.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
