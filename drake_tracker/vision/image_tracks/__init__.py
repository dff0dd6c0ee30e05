"""Several objects in the image: 2-D tracks of one camera, and stereo tracks from pairs of 2-D tracks.

Regions of motion go in; tracks in pixels come out, with two cameras tracks in space. `drake-tracker track --objects`
uses them. Begin with `image_tracker.py` and `stereo_tracks.py`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
