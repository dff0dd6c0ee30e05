"""Pictures and videos of a run of the train.

The scenario and the log of a run go in; figures, marks in the camera images and frames of the grasp come out. Begin
with `figures.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
