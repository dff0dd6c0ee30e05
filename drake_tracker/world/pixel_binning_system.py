"""Pixels that collect light over their whole area, which the renderer's do not."""

import cv2
from pydrake.common.value import Value
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U


class PixelBinningSystem(LeafSystem):
    """Averages squares of pixels into one.

    A renderer looks at one point of each pixel, so that the edge of a disc of ten pixels jumps by whole pixels, and its
    centroid by a tenth. A camera's pixel is as bright as its area is on average: that is the mean of many such points.

    .. pydrake_system::

        name: PixelBinningSystem
        input_ports:
        - color_image
        output_ports:
        - color_image

    color_image (ImageRgba8U): ``factor`` times as wide and as high in, (width, height) out. There is no state.
    """

    def __init__(self, width, height, factor):
        super().__init__()
        self._size = (width, height)
        self._image = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(factor * width, factor * height)))
        self.DeclareAbstractOutputPort(
            "color_image", lambda: Value(ImageRgba8U(width, height)), self._calc_image, {self._image.ticket()}
        )

    def _calc_image(self, context, output):
        image = self._image.Eval(context).data
        cv2.resize(image, self._size, dst=output.get_mutable_value().mutable_data, interpolation=cv2.INTER_AREA)
