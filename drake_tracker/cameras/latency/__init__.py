"""Latency of a camera: the time from the light that it sees to the stamp that its image gets.

In go the images of a camera that sees a running code on this machine's screen, or a light that this machine switches;
out comes the latency with its uncertainty, which `drake-tracker track` subtracts from the stamps.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
