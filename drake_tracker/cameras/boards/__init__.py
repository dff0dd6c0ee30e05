"""Calibration boards: chessboards, grids of circles and boards of markers.

The image of a board goes in; their corners or centres come out, in pixels, with their places on the board. Begin with
`board.py`, which defines the role of a board; each kind has a module.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
