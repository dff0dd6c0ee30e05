"""Solvers of camera calibration: lens, pose, pairs of cameras, and a camera on the hand.

Corners of boards go in; a `CameraModel`, the pose of one camera to another or of a camera to the hand comes out, with
residuals and uncertainty. Begin with `camera_calibration.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
