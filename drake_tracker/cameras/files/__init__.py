"""Files of calibrated cameras.

The text of a file goes in; calibrated cameras come out, or an error that names the file and the entry. Begin with
`calibration_file.py`, the format of this project; `camera_files.py` recognises those of OpenCV, ROS and Kalibr.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
