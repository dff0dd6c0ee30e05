"""Catching the ball, and touching the board to find it.

The predicted exit of the ball goes in, or the force at the probe; the next motion comes out. Begin with
`catch_schema.py`, the table of phases, and `catch_machine.py`. `touch_machine.py` touches three marks on the board, and
`board_touch.py` turns the touches into the pose of the board.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
