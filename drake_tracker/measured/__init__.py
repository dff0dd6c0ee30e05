"""Vision without images: these Systems read the truth, and add the measured error of the vision.

The true poses of the objects go in; points, tracks or parts come out, as late and as wrong as those of the cameras were
measured to be. A scenario asks for it with `vision: !Measured`. Begin with `measured_error.py`, the model of the error.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
