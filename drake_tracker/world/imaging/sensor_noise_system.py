"""Sensor noise and mains flicker on a rendered image, as a Drake System."""

import cv2
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.world.imaging.sensor_model import SensorNoise


class SensorNoiseSystem(LeafSystem):
    """Adds Gaussian sensor noise, and the flicker of the lamps, to a colour image.

    .. pydrake_system::

        name: SensorNoiseSystem
        input_ports:
        - color_image
        output_ports:
        - color_image

    Input ``color_image``: the rendered image, an ImageRgba8U of the window's size. Output ``color_image``: the noisy
    image, opaque, of the same type and size.

    The output is a function of the input and the time alone, so Drake caches it: it is evaluated once per instant,
    however many readers there are. There is no state.

    Args:
        noise: noise and flicker.
    """

    def __init__(self, noise: SensorNoise) -> None:
        super().__init__()
        self._noise = noise
        size = noise.window[2:] if noise.window else (noise.width, noise.height)
        self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(*size)))
        tickets = {self.time_ticket(), self.all_input_ports_ticket()}
        self.DeclareAbstractOutputPort("color_image", lambda: Value(ImageRgba8U(*size)), self._calc_image, tickets)

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        image = self.GetInputPort("color_image").Eval(context).data
        self._noise.add(image, context.get_time(), output.get_mutable_value().mutable_data)


class PixelBinningSystem(LeafSystem):
    """Averages squares of rendered pixels into one image pixel.

    A renderer samples one point of each pixel, so that the edge of a disc ten pixels wide jumps by whole pixels, and
    its centroid by a tenth. The brightness of a pixel is the average over its area: the mean of many such points.

    .. pydrake_system::

        name: PixelBinningSystem
        input_ports:
        - color_image
        output_ports:
        - color_image

    Input ``color_image``: ImageRgba8U, ``factor`` times as wide and as high as the output. Output ``color_image``:
    ImageRgba8U of width x height px. The output is a function of the input; there is no state.

    Args:
        width: of the output [px].
        height: of the output [px].
        factor: rendered pixels per image pixel, along u and along v.
    """

    def __init__(self, width: int, height: int, factor: int) -> None:
        super().__init__()
        self._size = (width, height)
        self._image = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(factor * width, factor * height)))
        self.DeclareAbstractOutputPort(
            "color_image", lambda: Value(ImageRgba8U(width, height)), self._calc_image, {self._image.ticket()}
        )

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        image = self._image.Eval(context).data
        cv2.resize(image, self._size, dst=output.get_mutable_value().mutable_data, interpolation=cv2.INTER_AREA)
