"""The laboratory of the conveyor: belt, parts, trays, and the judge of the picks.

Joint set-points go in; images, joint states, the encoder of the belt and the ``truth_*`` ports come out of
`ConveyorWorldDiagram`. Begin with `conveyor_world_diagram.py`; `arrivals.py` decides which part comes when.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
