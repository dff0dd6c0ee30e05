"""Tracking of moving objects with your own cameras, without a simulation.

In go videos, image folders, ROS 2 bags or live cameras, and their calibration; out come the measured, filtered and
predicted track as a table, a picture, a video and a summary. Vision and estimation are the same as in a simulated run.
Begin with `preparation.py`, which reads options and footage, then `own_cameras_diagram.py` and `track.py`, the run.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
