"""The live view: a page on 127.0.0.1 that shows a run while it is simulated, and can pause, step and slow it down.

In go the output ports of a hand-eye diagram, ground truth included, and the frames of its camera video; out comes the
page. Nothing that the live view computes is fed back into the diagram, so that a watched run has the same results.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
