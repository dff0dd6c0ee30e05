"""Parts on a moving belt.

Images of two cameras above the belt go in; the parts come out, each with kind, place on the belt and angle. Begin with
`part_vision_system.py`: `part_search.py` finds parts, `part_fit.py` fits outlines, `part_tracker.py` follows parts.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
