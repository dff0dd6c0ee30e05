import os
import re
import sqlite3
import struct
import sys

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.rosbag import IMAGE as IMAGE_TYPE
from drake_tracker.footage.rosbag import read_ros_image
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
        writer = Writer(stream, chunk_size=400)
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
    monkeypatch.setitem(sys.modules, "mcap.stream_reader", None)
    with pytest.raises(DrakeTrackerError, match=r"pip install 'drake-tracker\[rosbag\]'"):
        open_footage(f"{bag}:/right")


def as_database(bag, folder, files=1):
    """The same messages as rosbag2 stores them in SQLite, split into files."""
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    with open(bag, "rb") as stream:
        found = [(schema.name, channel.topic, m) for schema, channel, m in make_reader(stream).iter_messages()]
    numbers = {topic: k + 1 for k, topic in enumerate(sorted({topic for _, topic, _ in found}))}
    for part in range(files):
        base = sqlite3.connect(folder / f"bag_{part + 9}.db3")
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        for kind, topic, _ in {each[1]: each for each in found}.values():
            base.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr')", (numbers[topic], topic, kind))
        for _, topic, message in found[part * len(found) // files : (part + 1) * len(found) // files]:
            row = (numbers[topic], message.log_time, message.data)
            base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", row)
        base.commit()
        base.close()
    return folder


@pytest.mark.parametrize("files", [1, 3])
@pytest.mark.parametrize("topic", ["/left/image_raw", "/right"])
def test_a_folder_of_databases_is_the_same_bag(bag, tmp_path, files, topic):
    folder = as_database(bag, tmp_path / "Aufnahme 1 \u6e2c\u8a66", files)
    there, here = open_footage(f"{bag}:{topic}"), open_footage(f"{folder}:{topic}")
    assert (here.size, here.epoch) == (there.size, there.epoch)
    np.testing.assert_array_equal(here.times, there.times)
    for (_, one), (_, other) in zip(here.frames(), there.frames(), strict=True):
        np.testing.assert_array_equal(one, other)
    assert not [path for path in folder.iterdir() if path.suffix not in (".db3", ".yaml")]
    if files == 1:
        assert open_footage(f"{folder / 'bag_9.db3'}:{topic}").size == (6, 4)


def test_a_broken_database_is_one_line(tmp_path):
    for content, words in ((b"no bag", "file is not a database"), (b"", "it has no tables topics and messages")):
        (tmp_path / "bag.db3").write_bytes(content)
        with pytest.raises(DrakeTrackerError, match=f"bag.db3: this bag cannot be read: .*{words}") as caught:
            open_footage(str(tmp_path / "bag.db3"))
        assert "\n" not in str(caught.value)
    with pytest.raises(DrakeTrackerError, match="there is no such file"):
        open_footage(str(tmp_path / "nowhere.db3"))


def test_a_recording_that_was_not_ended_gives_the_images_that_it_has(bag):
    """Without the summary at the end, as after a loss of power, and cut off in a message."""
    bag.write_bytes(bag.read_bytes()[:-2000])
    footage = open_footage(f"{bag}:/left/image_raw")
    shown = [int(image[0, 0, 1]) for _, image in footage.frames()]
    assert shown == [20 * k for k in range(len(footage.times))] and 3 <= len(shown) <= 10
    assert re.fullmatch(
        rf"{bag}:/left/image_raw: the bag is damaged or incomplete; {len(shown)} images can be read: .+",
        footage.warning(),
    )


def test_a_whole_bag_has_no_warning(bag):
    assert open_footage(f"{bag}:/right").warning() is None


@pytest.mark.parametrize(("stamp", "warned"), [(0, False), (1_700_000_000_000_000_000, True)])
def test_headers_whose_stamps_do_not_change_give_no_times(tmp_path, stamp, warned):
    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream)
        kind = writer.register_msgdef("sensor_msgs/msg/CompressedImage", COMPRESSED)
        data = cv2.imencode(".png", np.zeros((4, 6, 3), np.uint8))[1].tobytes()
        for k in range(10):
            message = {"header": header(stamp), "format": "png", "data": data}
            writer.write_message("/a", kind, message, log_time=10**9 + 50_000_000 * k)
        writer.finish()
    footage = open_footage(str(tmp_path / "a.mcap"))
    np.testing.assert_allclose(footage.times, 0.05 * np.arange(10), atol=1e-9)
    assert len(list(footage.frames())) == 10
    line = f"{tmp_path / 'a.mcap'}:/a: the stamps of the headers do not change; the times of recording are used"
    assert footage.warning() == (line if warned else None)


@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
def test_a_pipe_is_no_bag(tmp_path, suffix):
    os.mkfifo(tmp_path / f"a{suffix}")
    with pytest.raises(DrakeTrackerError, match="this bag cannot be read: it is not a regular file"):
        open_footage(str(tmp_path / f"a{suffix}"))


BLOB = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
TOPICS = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT)"
MANY = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS id, 1 AS topic_id, i AS timestamp, "


@pytest.mark.parametrize(
    "statements",
    [
        [TOPICS, f"CREATE VIEW messages AS {MANY} zeroblob(1000000) AS data FROM n"],
        [BLOB, f"CREATE VIEW topics AS {MANY} 'a' AS name, 'b' AS type FROM n"],
        [TOPICS, BLOB.replace("data BLOB", "data BLOB GENERATED ALWAYS AS (zeroblob(300000000)) VIRTUAL")],
        [TOPICS, "CREATE VIRTUAL TABLE messages USING fts5(data)"],
    ],
)
def test_only_plain_tables_are_read(tmp_path, statements):
    base = sqlite3.connect(tmp_path / "a.db3")
    for statement in statements:
        base.execute(statement)
    base.commit()
    base.close()
    words = "a.db3: this bag cannot be read: it has no tables topics and messages as rosbag2 writes them"
    with pytest.raises(DrakeTrackerError, match=words):
        open_footage(str(tmp_path / "a.db3"))


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_chunk_that_grows_beyond_any_image_is_refused(tmp_path, monkeypatch, compression):
    monkeypatch.setattr("drake_tracker.footage.bag_storage.LARGEST_MESSAGE", 100_000)
    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream, compression=compression)
        kind = writer.register_msgdef("sensor_msgs/msg/CompressedImage", COMPRESSED)
        writer.write_message("/a", kind, {"header": header(1), "format": "png", "data": bytes(1_000_000)}, log_time=1)
        writer.finish()
    with pytest.raises(DrakeTrackerError, match="this bag cannot be read: a chunk is larger than any message"):
        open_footage(str(tmp_path / "a.mcap"))


def test_topics_without_images_are_listed(tmp_path):
    with open(tmp_path / "a.mcap", "wb") as stream:
        writer = Writer(stream)
        kind = writer.register_msgdef("std_msgs/msg/String", "string data")
        writer.write_message("/chatter", kind, {"data": "a"}, log_time=1)
        writer.finish()
    with pytest.raises(
        DrakeTrackerError, match=r"there is no topic with images .*; it has /chatter \(std_msgs/msg/String"
    ):
        open_footage(str(tmp_path / "a.mcap"))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.db3.zstd", "is compressed; use zstd -d"),
        ("a.mcap.zst", "is compressed"),
        ("a.bag", "is a bag of ROS 1; conv"),
    ],
)
def test_other_files_of_bags_are_named(tmp_path, name, words):
    (tmp_path / name).write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(DrakeTrackerError, match=f"{name}: {words}"):
        open_footage(str(tmp_path / name))


def message(encoding, data, width=8, height=4, step=None, order="<"):
    """An Image as a ROS node serializes it."""
    body = struct.pack(f"{order}iI", 5, 6)
    for text in (b"cam\0",):
        body += struct.pack(f"{order}I", len(text)) + text
    body += struct.pack(f"{order}II", height, width)
    text = encoding.encode() + b"\0"
    body += struct.pack(f"{order}I", len(text)) + text + b"\0"  # little-endian pixels
    body += b"\0" * (-len(body) % 4) + struct.pack(f"{order}I", step or len(data) // height)
    return (b"\0\1" if order == "<" else b"\0\0") + b"\0\0" + body + struct.pack(f"{order}I", len(data)) + data


COLOUR = np.array([200, 90, 40])


def encoded(encoding):
    """An image of 8 x 4 px of one colour, or of its brightness, in an encoding: (bytes, bytes in a row)."""
    rgb = np.full((4, 8, 3), COLOUR, np.uint8)
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    if encoding in ("mono16", "16UC1"):
        return (grey.astype("<u2") << 8).tobytes(), 16
    if encoding in ("rgb16", "bgr16"):
        return (rgb[..., :: -1 if encoding == "bgr16" else 1].astype("<u2") << 8).tobytes(), 48
    yuv = cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_I420).ravel()
    y, u, v = yuv[:32].reshape(4, 8), yuv[32], yuv[40]
    if encoding in ("nv12", "nv24"):
        return y.tobytes() + np.tile([u, v], 8 if encoding == "nv12" else 32).astype(np.uint8).tobytes(), 8
    if encoding == "nv21":
        return y.tobytes() + np.tile([v, u], 8).astype(np.uint8).tobytes(), 8
    pairs = np.empty((4, 8, 2), np.uint8)
    luma = 1 if encoding in ("uyvy", "yuv422") else 0
    pairs[..., luma] = y
    pairs[:, ::2, 1 - luma], pairs[:, 1::2, 1 - luma] = u, v
    return pairs.tobytes(), 16


@pytest.mark.parametrize(
    "encoding",
    ["mono16", "16UC1", "rgb16", "bgr16", "uyvy", "yuv422", "yuyv", "yuv422_yuy2", "nv21", "nv12", "nv24"],
)
def test_deep_and_yuv_images_have_their_colours(encoding):
    data, step = encoded(encoding)
    image = read_ros_image(message(encoding, data, step=step), IMAGE_TYPE, "bag")
    grey = int(COLOUR @ [0.299, 0.587, 0.114])
    expected = np.full(3, grey) if encoding in ("mono16", "16UC1") else COLOUR
    assert image.shape == (4, 8, 3) and np.abs(image - expected).max() <= 4


def test_byte_order_and_twelve_bits():
    values = np.arange(32, dtype=np.uint16).reshape(4, 8) * 100
    image = read_ros_image(message("mono16", values.tobytes(), step=16, order=">"), IMAGE_TYPE, "bag", bits=12)
    np.testing.assert_array_equal(image[..., 0], values >> 4)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"encoding": "32FC1"}, "encoding 32FC1 is not supported; rgb8"),
        ({"height": 2**32 - 1, "step": 2**32 - 1}, "damaged: 8 x 4294967295 px"),
        ({"width": 9}, "damaged: 9 x 4 px"),
        ({"width": 0}, "damaged: 0 x 4 px"),
    ],
)
def test_an_image_that_contradicts_itself_is_one_line(changed, words):
    facts = {"encoding": "uyvy", "data": encoded("uyvy")[0], "step": 16} | changed
    with pytest.raises(DrakeTrackerError, match=words):
        read_ros_image(message(**facts), IMAGE_TYPE, "bag")


def test_a_message_that_is_cut_off_anywhere_is_one_line():
    whole = message("mono8", bytes(32), step=8)
    for length in range(len(whole)):
        with pytest.raises(DrakeTrackerError, match="bag: an image is damaged: a message is cut off|a text of"):
            read_ros_image(whole[:length], IMAGE_TYPE, "bag")
