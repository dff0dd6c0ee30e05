"""Sensor noise and mains flicker on a rendered image, as a Drake System."""

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
        self.DeclareAbstractOutputPort(
            "color_image",
            lambda: Value(ImageRgba8U(*size)),
            self._calc_image,
            prerequisites_of_calc={self.time_ticket(), self.all_input_ports_ticket()},
        )

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        image = self.GetInputPort("color_image").Eval(context).data
        self._noise.add(image, context.get_time(), output.get_mutable_value().mutable_data)
