"""Reads MCAP files by the readers of the format."""

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def read_mcap(path):
    """Returns {topic: [(time [s], message)]} of a file; all messages are in Protocol Buffers."""
    topics = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
            value = decoder(message.data)
            topics.setdefault(channel.topic, []).append((1e-9 * message.log_time, value))
    return topics


def points_of(cloud):
    """Returns the points (n, 3) of a ``foxglove.PointCloud`` by its own description of its bytes."""
    assert [field.name for field in cloud.fields] == ["x", "y", "z"]
    assert all(field.type == field.FLOAT64 for field in cloud.fields)
    dtype = np.dtype({
        "names": ["x", "y", "z"],
        "formats": ["<f8"] * 3,
        "offsets": [field.offset for field in cloud.fields],
        "itemsize": cloud.point_stride,
    })  # fmt: skip
    points = np.frombuffer(cloud.data, dtype)
    return np.column_stack([points[axis] for axis in "xyz"])


def numbers_of(message):
    """Returns {name: value} of every field of a message in Protocol Buffers."""
    return {field.name: getattr(message, field.name) for field in message.DESCRIPTOR.fields}
