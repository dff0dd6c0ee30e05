"""Messages of Protocol Buffers that consist of named numbers: their schema and their bytes.

Foxglove and Rerun plot such messages field by field. JSON would be simpler, but Rerun does not read it. The encoding is
described in https://protobuf.dev/programming-guides/encoding, the schema in ``descriptor.proto``.
"""

import struct
from collections.abc import Iterable, Sequence

_VARINT, _DOUBLE, _BYTES = 0, 1, 2
"""Wire types."""


def number_schema(package: str, message: str, names: Sequence[str]) -> bytes:
    """Returns the ``FileDescriptorSet`` of a message with a ``double`` for each name, numbered from 1.

    Args:
        package: of the message, an identifier.
        message: name of the message, an identifier.
        names: of its fields, identifiers.
    """
    optional, double = 1, 1  # FieldDescriptorProto.Label and .Type
    fields = [
        _text(1, name) + _number(3, place) + _number(4, optional) + _number(5, double)
        for place, name in enumerate(names, 1)
    ]
    descriptor = _text(1, message) + b"".join(_bytes(2, field) for field in fields)
    file = _text(1, f"{package}/{message}.proto") + _text(2, package) + _bytes(4, descriptor) + _text(12, "proto3")
    return _bytes(1, file)


def encode_numbers(values: Iterable[float]) -> bytes:
    """Returns the bytes of a message of `number_schema` with these values, in the order of its names."""
    return b"".join(_tag(place, _DOUBLE) + struct.pack("<d", value) for place, value in enumerate(values, 1))


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def _tag(place: int, wire_type: int) -> bytes:
    return _varint(place << 3 | wire_type)


def _number(place: int, value: int) -> bytes:
    return _tag(place, _VARINT) + _varint(value)


def _bytes(place: int, value: bytes) -> bytes:
    return _tag(place, _BYTES) + _varint(len(value)) + value


def _text(place: int, value: str) -> bytes:
    return _bytes(place, value.encode())
