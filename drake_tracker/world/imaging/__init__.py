"""The simulated cameras: mounts, lights, rendering, sensor noise, and render processes.

The state of the plant goes in; camera images come out (`ImageRgba8U`). Begin with `camera_system.py`;
`pipelined_camera_system.py` renders the same images in other processes.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
