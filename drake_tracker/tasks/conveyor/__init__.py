"""The task of a conveyor: an arm picks parts from a moving belt and puts them into the cells of two trays.

A scenario goes in. `resolve` computes a `ConveyorSetup` from it, and `build` makes the hand-eye diagram of the set-up.
Begin with `scenario.py`, `setup.py` and `diagram.py`. After a run, `part_histories` computes the fate of each part from
the log, and `summarise_conveyor` counts the parts and gives the reasons for missed parts.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
