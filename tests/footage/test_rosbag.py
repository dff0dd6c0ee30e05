import sys

import cv2
import numpy as np
import pytest
from mcap_ros2.writer import Writer

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.sources import open_footage

HEADER = """std_msgs/Header header
{}
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
IMAGE = HEADER.format("uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data")
COMPRESSED = HEADER.format("string format\nuint8[] data")


def header(stamp):
    return {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "camera"}


@pytest.fixture
def bag(tmp_path):
    """Two topics: raw mono images every 50 ms, and red ones, compressed, every 50 ms but the third, 10 ms later."""
    path = tmp_path / "run.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream)
        raw = writer.register_msgdef("sensor_msgs/msg/Image", IMAGE)
        compressed = writer.register_msgdef("sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(10):
            stamp = 1_700_000_000_000_000_000 + 50_000_000 * k
            padded = np.full((4, 8), 20 * k, np.uint8)
            message = {"header": header(stamp), "height": 4, "width": 6, "encoding": "mono8", "is_bigendian": 0}
            message |= {"step": 8, "data": padded.tobytes()}
            writer.write_message("/left/image_raw", raw, message, log_time=stamp + 5_000_000)
            if k == 2:
                continue
            coded = cv2.imencode(".png", np.full((4, 6, 3), (0, 0, 100 + k), np.uint8))[1]
            message = {"header": header(stamp + 10_000_000), "format": "png", "data": coded.tobytes()}
            writer.write_message("/right", compressed, message, log_time=stamp + 15_000_000)
        writer.finish()
    return path


def test_topics_are_read_by_their_headers_stamps(bag):
    left = open_footage(f"{bag}:/left/image_raw")
    assert left.size == (6, 4) and left.epoch == pytest.approx(1.7e9, abs=1e-6)
    np.testing.assert_allclose(left.times, 0.05 * np.arange(10), atol=1e-9)
    assert [int(image[0, 0, 1]) for _, image in left.frames()] == [20 * k for k in range(10)]
    right = open_footage(f"{bag.parent}:/right")
    assert right.epoch - left.epoch == pytest.approx(0.01, abs=1e-6)
    np.testing.assert_allclose(right.times, np.delete(0.05 * np.arange(10), 2), atol=1e-9)
    assert next(right.frames())[1][0, 0].tolist() == [100, 0, 0]


@pytest.mark.parametrize(
    ("topic", "message"),
    [("", r"name one of its topics after a colon: /left/image_raw, /right"), (":/top", "there is no image topic /top")],
)
def test_a_topic_must_be_one_of_the_bags(bag, topic, message):
    with pytest.raises(DrakeTrackerError, match=message):
        open_footage(f"{bag}{topic}")


def test_a_broken_bag_is_one_line(bag):
    bag.write_bytes(b"no bag at all")
    with pytest.raises(DrakeTrackerError, match="run.mcap: this bag cannot be read: ") as caught:
        open_footage(f"{bag}:/right")
    assert "\n" not in str(caught.value)


def test_without_the_packages_it_says_how_to_get_them(bag, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap.reader", None)
    with pytest.raises(DrakeTrackerError, match=r"pip install 'drake-tracker\[rosbag\]'"):
        open_footage(f"{bag}:/right")
