"""Cameras: the model of a camera, its calibration, its calibration files and its latency.

Images of known boards go in; a `CameraModel` comes out, which turns pixels into rays and points into pixels. Begin with
`camera_model.py` and `triangulation.py`; `boards` finds calibration boards in images, `calibration` solves for the
camera, `files` reads and writes it, and `latency` measures how late its images are.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
