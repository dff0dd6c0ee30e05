"""Writes the seed corpus of the fuzzer: encoded messages, some good, some of kinds that once did harm.

    python tests/network/make_corpus.py

A new finding of the fuzzer becomes another file here, and stays.
"""

import sys
from pathlib import Path

import numpy as np
from drake import lcmt_drake_signal, lcmt_header, lcmt_image, lcmt_image_array

from drake_tracker.core.messages import Filtered, Prediction, TrackPoint
from drake_tracker.network.channels import encode_signal

sys.path.insert(0, str(Path(__file__).parents[1]))
from packets import BAD_PACKETS, circle_packet

CORPUS = Path(__file__).parent / "corpus"
POINT = [0.75, 0.62, 0.10, 0.485, 0.001, 1.0]


def vector(values, view, time=1.0, **changes):
    message = encode_signal(values, view.get_fields(), time)
    for name, value in changes.items():
        setattr(message, name, value)
    return message.encode()


def changed(**fields):
    point = TrackPoint(np.array(POINT))
    for name, value in fields.items():
        setattr(point, name, value)
    return point[:]


def image(width=8, height=4, count=1, **changes):
    one, message = lcmt_image(), lcmt_image_array()
    one.header, message.header = lcmt_header(), lcmt_header()
    message.header.utime = 1_000_000
    one.width, one.height, one.row_stride = width, height, 4 * width
    one.data = bytes(4 * width * height)
    one.size = len(one.data)
    one.pixel_format, one.channel_type = lcmt_image.PIXEL_FORMAT_RGBA, lcmt_image.CHANNEL_TYPE_UINT8
    one.compression_method = lcmt_image.COMPRESSION_METHOD_NOT_COMPRESSED
    for name, value in changes.items():
        setattr(message.header if name == "utime" else one, name, value)
    message.num_images, message.images = count, [one] * count
    return message.encode()


def messages():
    """Returns {name: encoded message}."""
    found = {
        "point": vector(POINT, TrackPoint),
        "point_far_away": vector(changed(x=1e300), TrackPoint),
        "point_nan": vector(changed(y=np.nan), TrackPoint),
        "point_of_the_future": vector(changed(stamp=1e18), TrackPoint),
        "point_at_the_end_of_time": vector(POINT, TrackPoint, timestamp=2**63 - 1),
        "point_before_the_start": vector(POINT, TrackPoint, timestamp=-1),
        "point_truncated": vector(POINT, TrackPoint)[:40],
        "filtered": vector([0.75, 0.62, 0.1, 0.485, 1.6, 0.15, 1.0], Filtered),
        "prediction": vector(circle_packet(0.75), Prediction),
        "image": image(),
        "image_of_another_size": image(5, 3),
        "image_two": image(count=2),
        "image_none": image(count=0),
        "image_at_the_end_of_time": image(utime=2**63 - 1),
        "image_truncated": image()[:-10],
        "empty_signal": lcmt_drake_signal().encode(),
        "empty": b"",
        "zeros": bytes(64),
    }
    spoilt = {"_".join(name.split()).replace(".", ""): spoil for name, (spoil, _) in BAD_PACKETS.items()}
    return found | {
        f"prediction_{name}": vector(spoil(circle_packet(0.75)), Prediction)
        for name, spoil in spoilt.items()
        if name in ("knots_of_1e308", "spacing_of_1e300", "stamp_at_the_end_of_time", "all_NaN", "path_below_the_table")
    }


if __name__ == "__main__":
    CORPUS.mkdir(exist_ok=True)
    for name, data in messages().items():
        (CORPUS / f"{name}.bin").write_bytes(data)
