"""Reads MCAP files by the readers of the format."""

import json

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def read_mcap(path):
    """Returns {topic: [(time [s], message)]} of a file; a message is a dict or of a Foxglove schema."""
    topics = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
            value = decoder(message.data) if decoder else json.loads(message.data)
            topics.setdefault(channel.topic, []).append((1e-9 * message.log_time, value))
    return topics
