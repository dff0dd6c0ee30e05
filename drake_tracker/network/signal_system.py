"""Vectors on ports and vectors on LCM channels: the Systems between Drake's own publishers, subscribers and ours."""

import numpy as np
from drake import lcmt_drake_signal
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.lcm import LcmPublisherSystem, LcmSubscriberSystem, PySerializer

from drake_tracker.network.channels import channel_of
from drake_tracker.network.signal_message import decode_signal, encode_signal


class SignalEncoder(LeafSystem):
    """Makes an LCM message of a vector.

    .. pydrake_system::

        name: SignalEncoder
        input_ports:
        - signal
        output_ports:
        - message

    ``signal`` has the given ``fields``; ``message`` is an `lcmt_drake_signal` with the Context's time. No state.
    """

    def __init__(self, fields):
        super().__init__()
        self._fields = tuple(fields)
        self._signal = self.DeclareVectorInputPort("signal", len(self._fields))
        self.DeclareAbstractOutputPort(
            "message",
            lambda: AbstractValue.Make(lcmt_drake_signal()),
            self._calc_message,
            {self._signal.ticket(), self.time_ticket()},
        )

    def _calc_message(self, context, output):
        output.set_value(encode_signal(self._signal.Eval(context), self._fields, context.get_time()))


class SignalDecoder(LeafSystem):
    """Makes a vector of an LCM message.

    .. pydrake_system::

        name: SignalDecoder
        input_ports:
        - message
        output_ports:
        - signal

    ``message`` is an `lcmt_drake_signal`; ``signal`` has the given ``fields``. It is all zeros, which is nothing yet,
    before the first message and where a message has other fields. No state.
    """

    def __init__(self, fields):
        super().__init__()
        self._fields = tuple(fields)
        self._message = self.DeclareAbstractInputPort("message", AbstractValue.Make(lcmt_drake_signal()))
        self.DeclareVectorOutputPort("signal", len(self._fields), self._calc_signal, {self._message.ticket()})

    def _calc_signal(self, context, output):
        values = decode_signal(self._message.Eval(context), self._fields)
        output.SetFromVector(np.zeros(len(self._fields)) if values is None else values)


class ForgivingSerializer(PySerializer):
    """Takes bytes that are no `lcmt_drake_signal` for an empty one: who shares the bus cannot end this process."""

    def __init__(self):
        super().__init__(lcmt_drake_signal)

    def Deserialize(self, buffer, abstract_value):
        try:
            super().Deserialize(buffer, abstract_value)
        except Exception:  # whatever garbage makes of a decoder that somebody else generated
            abstract_value.set_value(lcmt_drake_signal())


def add_sender(builder, lcm, port, vector):
    """Adds what publishes a vector on its channel. Returns the input port.

    Args:
      lcm: a DrakeLcm. port: name of the `HandEyeDiagram`'s port whose channel it is. vector: `channels.Vector`.
    """
    encoder = builder.AddNamedSystem(f"{port}_to_message", SignalEncoder(vector.fields))
    publisher = builder.AddNamedSystem(
        f"{port}_publisher",
        LcmPublisherSystem.Make(
            channel_of(port), lcmt_drake_signal, lcm, publish_period=vector.period, publish_offset=vector.offset
        ),
    )
    builder.Connect(encoder.GetOutputPort("message"), publisher.get_input_port())
    return encoder.GetInputPort("signal")


def add_receiver(builder, lcm, port, vector):
    """Adds what holds the newest vector of a channel. Returns the output port. Arguments as of `add_sender`."""
    subscriber = builder.AddNamedSystem(
        f"{port}_subscriber", LcmSubscriberSystem(channel_of(port), ForgivingSerializer(), lcm)
    )
    decoder = builder.AddNamedSystem(f"{port}_of_message", SignalDecoder(vector.fields))
    builder.Connect(subscriber.get_output_port(), decoder.GetInputPort("message"))
    return decoder.GetOutputPort("signal")
