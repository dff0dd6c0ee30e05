"""Sensor noise and mains flicker on a rendered image."""

import cv2
import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.cameras import ImageWindow

_BANK_MARGIN = 256
_BANK_STREAM = 0
_FRAME_STREAM = 1


def flicker_gain(time: float, depth: float, frequency: float) -> float:
    """Returns the gain of the light, 1 + depth sin(2 pi frequency time).

    Args:
        time: [s].
        depth: amplitude as a fraction of the mean brightness.
        frequency: of the light [Hz], twice that of the mains: 100 Hz on 50 Hz mains, 120 Hz on 60 Hz mains.
    """
    return 1.0 + depth * np.sin(2.0 * np.pi * frequency * time)


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
    however many readers there are. There is no state. Every frame, time / ``period`` rounded, has its own noise.

    The noise is luminance noise (the same on red, green and blue), white from pixel to pixel, rounded to whole grey
    levels, and clipped like the image at 0 and 255. It is a random crop of a bank of normal deviates, placed by
    ``default_rng([seed, 1, camera_index, frame])``, because drawing 65,536 new deviates would take 1.5 ms a frame. The
    bank has 257 x 257 places, so that frames repeat only after minutes; two cameras have different banks.

    The light of a render engine cannot change during a run, so flicker is a gain on the whole image, the same at every
    pixel: `flicker_gain` at the time of the frame. This is exact as long as nothing saturates and all light is lamp
    light.

    Args:
        width: of the full image [px].
        height: of the full image [px].
        noise: standard deviation of the noise [grey levels]; 0 for none.
        window: part of the full image that is rendered; None is all of it. The noise of a pixel does not depend on the
            window.
        flicker: amplitude of the flicker as a fraction of the mean brightness; 0 for none.
        flicker_hz: frequency of the light [Hz].
        period: time between frames [s].
        seed: selects the random numbers.
        camera_index: selects the random numbers of one camera.
    """

    def __init__(
        self,
        *,
        width: int,
        height: int,
        noise: float,
        window: ImageWindow | None = None,
        flicker: float = 0.0,
        flicker_hz: float = 100.0,
        period: float = VISION_PERIOD,
        seed: int = 0,
        camera_index: int = 0,
    ) -> None:
        super().__init__()
        self._window = window or (0, 0, width, height)
        self._flicker = flicker
        self._flicker_hz = flicker_hz
        self._period = period
        self._key = [seed, _FRAME_STREAM, camera_index]
        shape = (height + _BANK_MARGIN, width + _BANK_MARGIN)
        deviates = np.random.default_rng([seed, _BANK_STREAM, camera_index]).standard_normal(shape, dtype=np.float32)
        grey = np.rint(noise * deviates)
        # Two unsigned banks, what to add and what to subtract: OpenCV's saturating 8-bit sums are then one pass each.
        self._brighter = _as_rgba(grey, alpha=255)
        self._darker = _as_rgba(-grey, alpha=0)
        image_size = self._window[2:]
        self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(*image_size)))
        self.DeclareAbstractOutputPort(
            "color_image",
            lambda: Value(ImageRgba8U(*image_size)),
            self._calc_image,
            prerequisites_of_calc={self.time_ticket(), self.all_input_ports_ticket()},
        )

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        image = self.GetInputPort("color_image").Eval(context).data
        result = output.get_mutable_value().mutable_data
        time = context.get_time()
        if self._flicker > 0.0:
            image = cv2.convertScaleAbs(image, alpha=flicker_gain(time, self._flicker, self._flicker_hz))
        frame = round(time / self._period)
        u0, v0, width, height = self._window
        u, v = (u0, v0) + np.random.default_rng([*self._key, frame]).integers(0, _BANK_MARGIN, 2, endpoint=True)
        crop = np.s_[v : v + height, u : u + width]
        # One of the two is zero at every pixel, so the order of the saturating sums does not matter. The first also
        # makes alpha opaque again.
        cv2.add(image, self._brighter[crop], dst=result)
        cv2.subtract(result, self._darker[crop], dst=result)


def _as_rgba(grey: np.ndarray, alpha: int) -> np.ndarray:
    """Returns grey levels (h, w) as bytes (h, w, 4), negative ones as 0."""
    rgba = np.full((*grey.shape, 4), alpha, dtype=np.uint8)
    rgba[..., :3] = np.clip(grey, 0.0, 255.0)[..., np.newaxis]
    return rgba
