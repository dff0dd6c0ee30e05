"""Several objects in space: background subtraction, silhouettes, and tracks from two cameras.

Images of two calibrated cameras go in; tracks of objects with place, heading and shape come out, and the point of the
object that is to be grasped. Begin with `tracker.py`: background, silhouettes and regions are its input, targets its
output.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
