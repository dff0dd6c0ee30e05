"""The laboratory of the train: tracks, trains, other objects, and the judge of the grasp.

Joint set-points go in; images, joint states and the ``truth_*`` ports come out of `WorldDiagram`. Begin with
`world_diagram.py`; `tracks.py` has the shapes of the track, `rail_system.py` drives the train along it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
