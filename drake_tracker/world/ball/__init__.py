"""The laboratory of the ball: the board with its pegs, the ball, and the judge of the catch.

Joint set-points go in; images, joint states and the ``truth_*`` ports come out of `BallWorldDiagram`. Begin with
`ball_world_diagram.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
