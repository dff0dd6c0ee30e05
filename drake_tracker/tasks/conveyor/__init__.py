"""The task of a conveyor: an arm picks parts from a moving belt and puts them into the cells of two trays.

A scenario goes in. `resolve` computes what it amounts to, a `ConveyorSetup`, and `build` makes the hand-eye diagram of
it. Begin with `scenario.py`, `setup.py` and `diagram.py`. After a run, its log goes into
`part_histories`, what became of each part, and `summarise_conveyor`, which counts them and says why parts were missed.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
