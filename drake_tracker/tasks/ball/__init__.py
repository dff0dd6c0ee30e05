"""The task of Nashman and Chaconas 1990: one camera, a board of pegs, and an arm that catches the ball.

A scenario goes in. `initialise_board` finds the board with the camera and by touch, `resolve` computes a `BallSetup`
from scenario and `BoardPoses`, and `build` makes the hand-eye diagram of the set-up. After a run, its log goes into
`summarise_ball`, which measures errors against ground truth and says why a ball was not caught. Begin with
`scenario.py`, `setup.py` and `diagram.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
