"""Vectors on ports and vectors on LCM channels: the Systems between Drake's publishers and subscribers and ours."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from drake import lcmt_drake_signal
from pydrake.common.value import AbstractValue
from pydrake.lcm import DrakeLcm
from pydrake.systems.framework import Context, DiagramBuilder, InputPort, LeafSystem, OutputPort
from pydrake.systems.lcm import LcmPublisherSystem, LcmSubscriberSystem, PySerializer

from drake_tracker.network.channels import SENDER, Vector, channel_of, decode_signal, encode_signal


class SignalEncoder(LeafSystem):
    """Converts a vector to an LCM message.

    .. pydrake_system::

        name: SignalEncoder
        input_ports:
        - signal
        - sender
        output_ports:
        - message

    - ``signal``: a vector with the given fields.
    - ``sender``: values of `channels.SENDER`. Not connected: the message names no sender.
    - ``message``: an `lcmt_drake_signal` with the Context's time, computed when it is read. There is no state.

    Args:
        fields: names of the vector's fields.
    """

    def __init__(self, fields: Iterable[str]) -> None:
        super().__init__()
        self._fields = tuple(fields)
        self._signal = self.DeclareVectorInputPort("signal", len(self._fields))
        self._sender = self.DeclareVectorInputPort("sender", len(SENDER))
        self.DeclareAbstractOutputPort(
            "message",
            lambda: AbstractValue.Make(lcmt_drake_signal()),
            self._calc_message,
            {self._signal.ticket(), self._sender.ticket(), self.time_ticket()},
        )

    def _calc_message(self, context: Context, output: Any) -> None:
        sender = self._sender.Eval(context) if self._sender.HasValue(context) else ()
        output.set_value(encode_signal(self._signal.Eval(context), self._fields, context.get_time(), sender))


class SignalDecoder(LeafSystem):
    """Converts an LCM message to a vector.

    .. pydrake_system::

        name: SignalDecoder
        input_ports:
        - message
        output_ports:
        - signal

    - ``message``: an `lcmt_drake_signal`.
    - ``signal``: a vector with the given fields, computed when it is read. All zeros: there was no message yet, or it
      cannot be used: it has other fields, or a number that is not finite. There is no state.

    Args:
        fields: names of the vector's fields.
        faults: whether the reader judges messages itself: a number that is not finite is passed on, and a message that
            cannot be read becomes a vector of NaN.
    """

    def __init__(self, fields: Iterable[str], *, faults: bool = False) -> None:
        super().__init__()
        self._fields, self._faults = tuple(fields), faults
        self._message = self.DeclareAbstractInputPort("message", AbstractValue.Make(lcmt_drake_signal()))
        self.DeclareVectorOutputPort("signal", len(self._fields), self._calc_signal, {self._message.ticket()})

    def _calc_signal(self, context: Context, output: Any) -> None:
        message = self._message.Eval(context)
        values = decode_signal(message, self._fields)
        if values is None and self._faults and message.dim != 0:
            values = np.full(len(self._fields), np.nan)
        if values is None or not (self._faults or np.isfinite(values).all()):
            values = np.zeros(len(self._fields))
        output.SetFromVector(values)


class ForgivingSerializer(PySerializer):
    """Reads bytes that are no `lcmt_drake_signal` as one of -1 fields: no sender on the bus can end this process."""

    def __init__(self) -> None:
        super().__init__(lcmt_drake_signal)

    def Deserialize(self, buffer: bytes, abstract_value: AbstractValue) -> None:
        """Sets the value to the message in the buffer, or to a message of -1 fields."""
        try:
            super().Deserialize(buffer, abstract_value)
        except Exception:  # garbage can raise anything in the generated decoder
            unreadable = lcmt_drake_signal()
            unreadable.dim = -1
            abstract_value.set_value(unreadable)


def add_sender(
    builder: DiagramBuilder, *, lcm: DrakeLcm, port: str, vector: Vector, sender: OutputPort | None = None
) -> InputPort:
    """Adds the Systems that publish a vector on its channel. Returns the input port of the vector.

    Args:
        builder: the diagram's builder.
        lcm: connection to the bus.
        port: name of the port of `HandEyeDiagram` to which the channel belongs.
        vector: fields, period and offset of the channel.
        sender: values of `channels.SENDER`, which the messages name; None: they name none.
    """
    encoder = builder.AddNamedSystem(f"{port}_to_message", SignalEncoder(vector.fields))
    publisher = builder.AddNamedSystem(
        f"{port}_publisher",
        LcmPublisherSystem.Make(
            channel_of(port), lcmt_drake_signal, lcm, publish_period=vector.period, publish_offset=vector.offset
        ),
    )
    builder.Connect(encoder.GetOutputPort("message"), publisher.get_input_port())
    if sender is not None:
        builder.Connect(sender, encoder.GetInputPort("sender"))
    return encoder.GetInputPort("signal")


def add_receiver(
    builder: DiagramBuilder, *, lcm: DrakeLcm, port: str, vector: Vector, faults: bool = False
) -> OutputPort:
    """Adds the Systems that hold the newest vector of a channel. Returns the output port of the vector.

    Args:
        builder: the diagram's builder.
        lcm: connection to the bus, which needs an LcmInterfaceSystem.
        port: name of the port of `HandEyeDiagram` to which the channel belongs.
        vector: fields of the channel; period and offset are not used.
        faults: whether the reader judges messages itself, see `SignalDecoder`.
    """
    subscriber = builder.AddNamedSystem(
        f"{port}_subscriber", LcmSubscriberSystem(channel_of(port), ForgivingSerializer(), lcm)
    )
    decoder = builder.AddNamedSystem(f"{port}_of_message", SignalDecoder(vector.fields, faults=faults))
    builder.Connect(subscriber.get_output_port(), decoder.GetInputPort("message"))
    return decoder.GetOutputPort("signal")
