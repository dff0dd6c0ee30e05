"""Vision: images go in, points come out.

Each method has a folder: `centroid` (the motion centroid of the papers), `silhouettes` (several objects in space),
`image_tracks` (several objects in images of your own cameras), `parts` (parts on a belt), `hand` (the arm itself). The
common part is in this folder: triangulation (`TriangulatorSystem`, which makes a `TrackPoint` in the world from the
centroids of two calibrated cameras), the delay line, the mask of a detection, regions of interest, and motion of the
camera itself. Begin with `centroid/vision_diagram.py` for one object and `several_vision_diagram.py` for several.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
