"""Vision: images go in, points come out.

Each camera's images (`ImageRgba8U`, from a simulated `RgbdSensor` or from footage) become a motion centroid in pixels
(`add_motion_centroid`, with one of the motion detectors). A localiser turns the centroids into a `TrackPoint` in the
world: `add_triangulator` for two calibrated cameras, `add_plane_projector` for one camera and a known plane.
`CameraModel` is the calibration of a camera; `VisionDiagram` and `BoardVisionDiagram` are the two papers' complete
pipelines, and `MeasuredVisionDiagram` stands in for one of them without images. `SeveralVisionDiagram` tracks several
objects by their silhouettes and outputs the point of one of them, the target.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
