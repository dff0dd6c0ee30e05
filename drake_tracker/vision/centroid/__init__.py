"""The vision of both papers: motion detector, motion centroid, and the plane of the board.

Images of a camera go in; the motion centroid in pixels comes out (`MotionCentroidSystem`), found by one of the motion
detectors. Begin with `vision_diagram.py` for two cameras or `board_vision_diagram.py` for one; `normal_flow.py` is the
detector of Allen et al., `frame_difference.py` the detector of Nashman and Chaconas.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
