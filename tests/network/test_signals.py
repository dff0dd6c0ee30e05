"""Vectors to messages and back; the channels are those that docs/reference/lcm.md describes."""

import re
from pathlib import Path

import numpy as np
import pytest
from drake import lcmt_drake_signal
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem
from pydrake.systems.primitives import ConstantVectorSource

from drake_tracker.core.messages import Prediction, TrackPoint, message_size
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.network.channels import CAMERAS, channel_of, decode_signal, encode_signal, vectors
from drake_tracker.network.signal_system import add_receiver, add_sender


@pytest.mark.parametrize("view", [TrackPoint, Prediction])
def test_a_vector_survives_the_round_trip_bit_for_bit(view):
    values = np.random.default_rng(1).normal(size=message_size(view)) / 3.0
    message = lcmt_drake_signal.decode(encode_signal(values, view.get_fields(), 1.2345).encode())
    assert message.timestamp == 1234 and list(message.coord) == list(view.get_fields())
    np.testing.assert_array_equal(decode_signal(message, view.get_fields()), values)


def test_nan_and_infinity_survive_the_round_trip():
    message = encode_signal([np.nan, np.inf], ["a", "b"], 0.0)
    back = decode_signal(lcmt_drake_signal.decode(message.encode()), ["a", "b"])
    assert np.isnan(back[0]) and np.isinf(back[1])


def test_a_message_with_other_fields_gives_none():
    message = encode_signal([1.0, 2.0], ["x", "y"], 0.0)
    assert decode_signal(message, ["x", "z"]) is None and decode_signal(message, ["x"]) is None
    assert decode_signal(lcmt_drake_signal(), ["x"]) is None


def test_through_drakes_systems_a_signal_arrives_and_is_zero_before():
    lcm, vector = DrakeLcm("memq://"), vectors(TIME_STEP)["jaws"]
    builder = DiagramBuilder()
    builder.AddSystem(LcmInterfaceSystem(lcm))
    source = builder.AddSystem(ConstantVectorSource([0.08, -0.1, 25.0]))
    builder.Connect(source.get_output_port(), add_sender(builder, lcm=lcm, port="jaws", vector=vector))
    builder.ExportOutput(add_receiver(builder, lcm=lcm, port="jaws", vector=vector), "heard")
    simulator = Simulator(builder.Build())
    heard = simulator.get_system().GetOutputPort("heard")
    assert not np.any(heard.Eval(simulator.get_context()))
    simulator.AdvanceTo(0.02)
    np.testing.assert_array_equal(heard.Eval(simulator.get_context()), [0.08, -0.1, 25.0])


def test_every_channel_and_every_field_is_documented():
    text = (Path(__file__).parents[2] / "docs" / "reference" / "lcm.md").read_text(encoding="utf-8")
    known = vectors(TIME_STEP)
    documented = set(re.findall(r"`(DRAKE_TRACKER_[A-Z_]+)`", text))
    assert documented == {channel_of(port) for port in (*known, *CAMERAS)}
    for port, vector in known.items():
        for name in vector.fields:
            general = re.sub(r"\d+$", "", name)
            assert re.search(rf"`{general}(\d*|k|i)`", text), f"{port}: {name}"
