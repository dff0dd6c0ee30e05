"""Footage: recordings and live cameras go in, images with their capture times come out.

`open_footage` reads a video file, a folder of images, a ROS 2 bag or a connected camera as `Footage`; `align` puts one
or two of them on a common clock (`Timeline`); `VideoSource` outputs the images of one camera as a Drake System, in
place of a simulated camera.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
