"""Drake System of the faults of a camera's images."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, OutputPort, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.timing import VISION_PERIOD, capture_time
from drake_tracker.faults.fault import Fault, FaultyView, ImageFault, faults_at


@dataclass(frozen=True)
class HeldImages(FrozenState):
    """State of an `ImageFaultsSystem`.

    Attributes:
        images: for each fault, the image at its beginning, read-only; None while it does not act.
    """

    images: tuple[np.ndarray | None, ...]


class ImageFaultsSystem(LeafSystem):
    """Changes the images of a camera as faults do.

    .. pydrake_system::

        name: ImageFaultsSystem
        input_ports:
        - color_image
        output_ports:
        - color_image

    Both ports are an ImageRgba8U of the window's size. While no fault acts, the output is the input. The state, updated
    every ``period``, holds the image at the beginning of each fault.

    Args:
        view: the camera.
        faults: applied in this order.
        period: time between frames [s].
        latency: frames from the capture of an image until the input shows it.
    """

    def __init__(
        self, view: FaultyView, faults: Sequence[ImageFault], *, period: float = VISION_PERIOD, latency: int = 0
    ) -> None:
        super().__init__()
        self._latency, self._period = latency, period
        self._view, self._faults = view, tuple(faults)
        size = view.window[2:]
        self._input = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U(*size)))
        held = HeldImages((None,) * len(self._faults))
        self._state_index = self.DeclareAbstractState(AbstractValue.Make(held))
        tickets = {self.time_ticket(), self._input.ticket(), self.abstract_state_ticket(self._state_index)}
        self.DeclareAbstractOutputPort("color_image", lambda: Value(ImageRgba8U(*size)), self._calc_image, tickets)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._hold)

    def _hold(self, context: Context, state: State) -> None:
        held = context.get_abstract_state(self._state_index).get_value()
        time, images = capture_time(context.get_time(), self._latency, self._period), list(held.images)
        for number, fault in enumerate(self._faults):
            if not fault.active(time):
                images[number] = None
            elif images[number] is None:
                images[number] = read_only(self._input.Eval(context).data.copy())
        if any(new is not old for new, old in zip(images, held.images)):
            state.get_mutable_abstract_state(self._state_index).set_value(HeldImages(tuple(images)))

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        image, time = self._input.Eval(context).data, capture_time(context.get_time(), self._latency, self._period)
        held = context.get_abstract_state(self._state_index).get_value()
        for fault, before in zip(self._faults, held.images):
            if fault.active(time):
                image = fault.image(image, self._view, time, before)
        output.get_mutable_value().mutable_data[:] = image


def add_image_faults(
    builder: DiagramBuilder,
    *,
    image_port: OutputPort,
    view: FaultyView,
    faults: Sequence[Fault],
    name: str,
    latency: int = 0,
) -> OutputPort:
    """Adds the faults of a camera's images to a diagram, if there are any.

    Args:
        builder: of the diagram.
        image_port: images of the camera, of its window.
        view: the camera.
        faults: all faults of the run.
        name: of the System.
        latency: frames from the capture of an image until the port shows it.

    Returns the port with the changed images, or the given one when no fault concerns this camera.
    """
    own = [fault for fault in faults_at(faults, ImageFault) if fault.hits(view.camera)]
    if not own:
        return image_port
    system = builder.AddNamedSystem(name, ImageFaultsSystem(view, own, latency=latency))
    builder.Connect(image_port, system.GetInputPort("color_image"))
    return system.GetOutputPort("color_image")
