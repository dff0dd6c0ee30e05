"""The host's process on points that a test sends to it."""

import numpy as np
import pytest
from drake import lcmt_drake_signal, lcmt_header, lcmt_image, lcmt_image_array
from pydrake.lcm import DrakeLcm

from drake_tracker import load_scenario
from drake_tracker.core.messages import Prediction, TrackPoint
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.network.channels import channel_of, decode_signal, encode_signal
from drake_tracker.network.mailbox import MOST_WAITING
from drake_tracker.run.host_process import SILENCE, HostProcess

LAG = 0.25


class Sender:
    """Stands for the arm's process: sends points on a circle, and keeps the packets that come back."""

    def __init__(self, overrides=("vision=!Measured {}",)):
        self.lcm = DrakeLcm("memq://")
        self.scenario = load_scenario("train:learned", overrides=list(overrides))
        self.news, self.packets, self.wall = [], [], 0.0
        self.lcm.Subscribe(channel_of("prediction"), self._keep)
        self.host = self.new_host()

    def new_host(self):
        return HostProcess(self.scenario, self.lcm, self.lcm, tell=self.news.append, clock=lambda: self.wall)

    def _keep(self, data):
        self.packets.append(Prediction(decode_signal(lcmt_drake_signal.decode(data), Prediction.get_fields())))

    def send(self, cycles):
        for cycle in cycles:
            self.publish(self.point(cycle)[:], cycle)
        self.lcm.HandleSubscriptions(0)

    def publish(self, values, cycle):
        message = encode_signal(values, TrackPoint.get_fields(), cycle * VISION_PERIOD + 0.0008)
        self.lcm.Publish(channel_of("point"), message.encode())
        self.host.step(timeout=0.0)

    @staticmethod
    def point(cycle):
        angle = cycle * VISION_PERIOD * 0.15 / 0.15
        return TrackPoint(
            [cycle * VISION_PERIOD - LAG, 0.56 + 0.15 * np.cos(angle), 0.15 * np.sin(angle), 0.48, 0.001, 1.0]
        )

    def last(self):
        return np.array(self.packets[-1][:])


def test_there_is_a_packet_for_each_point_and_an_invalid_one_before_that():
    sender = Sender()
    sender.send(range(90))
    assert len(sender.packets) == 90 and not sender.packets[0].valid
    valid = [packet for packet in sender.packets if packet.valid]
    assert len(valid) > 40 and np.diff([packet.stamp for packet in valid]) == pytest.approx(VISION_PERIOD)
    assert sender.host.counts["packets"] == len(valid)
    assert sender.news == ["receiving from the arm; its clock is at 0.00 s"]


def test_messages_that_arrive_while_the_host_is_busy_are_all_processed():
    one, other = Sender(), Sender()
    one.send(range(90))
    busy, other.host.step = other.host.step, lambda timeout: None
    other.send(range(60))
    assert busy(0.0) == 60
    other.host.step = busy
    other.send(range(60, 90))
    np.testing.assert_array_equal(one.last(), other.last())


def test_a_host_that_is_too_slow_skips_the_oldest_and_reports_it():
    sender = Sender()
    step, sender.host.step = sender.host.step, lambda timeout: None
    sender.send(range(MOST_WAITING + 30))
    assert step(0.0) == MOST_WAITING
    assert sender.host.counts["skipped"] == 30 and "slower than the arm: skipping the oldest messages" in sender.news
    assert sender.host.time == pytest.approx((MOST_WAITING + 29) * VISION_PERIOD, abs=VISION_PERIOD)


def test_the_host_restarts_with_the_laboratory():
    sender, fresh = Sender(), Sender()
    sender.send(range(100, 200))
    del sender.packets[:]
    sender.send(range(90))
    assert not sender.packets[0].valid  # a clean slate, not the other train's path
    fresh.send(range(90))
    np.testing.assert_array_equal(sender.last(), fresh.last())
    assert sender.news[1:] == ["the arm's clock went back to 0.00 s: restarting"]


def test_lost_points_affect_no_others():
    sender = Sender()
    sender.send(range(90))
    before = sender.packets[-1]
    sender.send(range(101, 131))
    after = sender.packets[-1]
    assert after.seq - before.seq == 30 and after.stamp == pytest.approx(before.stamp + 41 * VISION_PERIOD)
    assert sender.host.counts["laboratories"] == 1 and sender.host.counts["cycles_incomplete"] == 11


def test_a_host_that_joins_late_follows_the_senders_clock():
    sender = Sender()
    unix = round(1.7e9 / VISION_PERIOD)  # a real robot's driver counts from 1970
    sender.send(range(unix, unix + 90))
    assert sender.packets[-1].valid and sender.packets[-1].stamp == pytest.approx(1.7e9 + 89 * VISION_PERIOD - LAG)


def test_silence_and_its_end_are_reported_once():
    sender = Sender()
    sender.host.step(0.0)
    sender.wall = 60.0
    sender.host.step(0.0)
    assert sender.news == []  # nobody was there yet
    sender.send(range(10))
    for _ in range(3):
        sender.wall += 0.7 * SILENCE
        sender.host.step(0.0)
    sender.send(range(10, 20))
    assert [line.split(",")[0].split(" since")[0] for line in sender.news[1:]] == [
        "the arm has been silent",
        "receiving from the arm again",
    ]


@pytest.mark.parametrize("garbage", [b"", b"\x00" * 40, lcmt_image_array().encode(), b"\x00" * 10**6])
def test_garbage_on_the_bus_does_not_end_the_host(garbage):
    sender = Sender()
    sender.lcm.Publish(channel_of("point"), garbage)
    sender.lcm.Publish(channel_of("point"), encode_signal([1.0], ["altitude"], 0.0).encode())
    sender.send(range(1, 90))
    assert sender.packets[-1].valid and sender.host.counts["not_understood"] == 2
    assert sum("POINT: ignoring a message: it" in line for line in sender.news) == 2


STRAY = {
    "far away": {"x": 1e300},
    "not a number": {"y": np.nan},
    "infinite": {"z": -np.inf},
    "from the future": {"stamp": 1e18},
    "a second ahead": {"stamp": 121 * VISION_PERIOD + 1.0},
    "from the past": {"stamp": -1e18},
    "from nowhere": {"stamp": np.nan},
    "hardly valid": {"valid": np.inf},
}


@pytest.mark.parametrize("changes", STRAY.values(), ids=STRAY)
def test_a_point_that_cannot_be_right_is_as_if_it_had_been_lost(changes):
    disturbed, other = Sender(), Sender()
    for sender in (disturbed, other):
        sender.send(range(120))
    point = disturbed.point(120)
    for name, value in changes.items():
        setattr(point, name, value)
    disturbed.publish(point[:], 120)
    for sender in (disturbed, other):
        sender.send(range(121, 240))
    np.testing.assert_array_equal(disturbed.last(), other.last())
    assert disturbed.host.counts["points_refused"] == 1 and other.host.counts["points_refused"] == 0
    assert sum("ignoring a point" in line for line in disturbed.news) == 1


@pytest.mark.parametrize("timestamp", [2**63 - 1, -(2**63), -1, 10**13, 10**6, 5000])
def test_one_message_with_a_wrong_time_neither_restarts_nor_silences_the_host(timestamp):
    disturbed, other = Sender(), Sender()
    disturbed.send(range(120))
    message = encode_signal(disturbed.point(120)[:], TrackPoint.get_fields(), 0.0)
    message.timestamp = timestamp
    disturbed.lcm.Publish(channel_of("point"), message.encode())
    disturbed.send(range(120, 240))
    other.send(range(240))
    np.testing.assert_array_equal(disturbed.last(), other.last())
    assert disturbed.host.counts["laboratories"] == 1


def test_a_flood_is_bounded_and_the_newest_message_wins():
    sender = Sender()
    sender.send(range(60))
    fields = TrackPoint.get_fields()
    flood = encode_signal([0.0] * len(fields), fields, 60 * VISION_PERIOD).encode()
    for _ in range(100_000):
        sender.lcm.Publish(channel_of("point"), flood)
    sender.send(range(61, 121))
    assert sender.packets[-1].valid and sender.packets[-1].stamp == pytest.approx(120 * VISION_PERIOD - LAG)
    assert sender.host.counts["skipped"] > 99_000 and sender.host.counts["laboratories"] == 1


def image_message(width, height, **changes):
    """An encoded image of the given size; ``changes`` are fields of the image or of the message."""
    image, images = lcmt_image(), lcmt_image_array()
    images.header, images.num_images, images.images = lcmt_header(), 1, [image]
    image.header, image.width, image.height, image.row_stride = lcmt_header(), width, height, min(4 * width, 2**31 - 1)
    image.pixel_format, image.channel_type = lcmt_image.PIXEL_FORMAT_RGBA, lcmt_image.CHANNEL_TYPE_UINT8
    image.compression_method = lcmt_image.COMPRESSION_METHOD_NOT_COMPRESSED
    for name, value in changes.items():
        setattr(images.header if name == "utime" else images if name == "num_images" else image, name, value)
    image.data = image.data or bytes(min(max(4 * image.width * image.height, 0), 10**7))
    image.size = changes.get("size", len(image.data))
    return images.encode()


UNUSABLE = {
    "another size": ({"width": 32, "height": 16}, "the image has 32 x 16 px, but this scenario needs"),
    "a larger size": ({"width": 900}, "it is larger than an image, and this scenario needs"),
    "an absurd size": ({"width": 2**31 - 1, "height": 2**31 - 1, "data": b"123"}, "the image has 2147483647 x 21474"),
    "a negative size": ({"width": -1}, "the image has -1 x"),
    "no pixels": ({"data": b"x"}, "the image is not in rows of RGBA"),
    "grey": ({"pixel_format": lcmt_image.PIXEL_FORMAT_GRAY}, "the image is not in rows of RGBA"),
    "floats": ({"channel_type": lcmt_image.CHANNEL_TYPE_FLOAT32}, "the image is not in rows of RGBA"),
    "jpeg": ({"compression_method": lcmt_image.COMPRESSION_METHOD_JPEG}, "the image is not in rows of RGBA"),
    "zlib": ({"compression_method": lcmt_image.COMPRESSION_METHOD_ZLIB}, "the image is not in rows of RGBA"),
    "another stride": ({"row_stride": 2**31 - 1}, "the image is not in rows of RGBA"),
    "a time before the start": ({"utime": -1}, "its time, -1e-06 s, is no time of a clock"),
    "the end of time": ({"utime": 2**63 - 1}, "its time, 9.22337e+12 s, is no time of a clock"),
}


@pytest.fixture(scope="module")
def seeing():
    """A host with cameras, which no other test changes."""
    sender = Sender(overrides=())
    return sender, sender.host._image_sizes["camera_left"]


@pytest.mark.parametrize("changes, words", UNUSABLE.values(), ids=UNUSABLE)
def test_an_image_that_cannot_be_used_is_counted_and_explained_once(seeing, changes, words):
    sender, (width, height) = seeing
    before = sender.host.counts["not_understood"]
    del sender.news[:]
    sender.host._reported.clear()
    data = image_message(**({"width": width, "height": height} | changes))
    for _ in range(3):
        sender.lcm.Publish(channel_of("camera_left"), data)
    assert sender.host.step(0.0) == 0 and sender.host.counts["not_understood"] == before + 3
    (line,) = sender.news
    assert line.startswith(f"DRAKE_TRACKER_CAMERA_LEFT: ignoring a message: {words}")


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda data: data[:50], lambda data: b"x" + data])
def test_a_damaged_image_is_ignored(seeing, damage):
    sender, size = seeing
    before = sender.host.counts["not_understood"]
    sender.lcm.Publish(channel_of("camera_left"), damage(image_message(*size)))
    assert sender.host.step(0.0) == 0 and sender.host.counts["not_understood"] == before + 1


def test_good_images_are_used_between_unusable_ones():
    sender = Sender(overrides=())
    size = sender.host._image_sizes["camera_left"]
    for cycle in range(3):
        for side in ("camera_left", "camera_right"):
            sender.lcm.Publish(channel_of(side), image_message(32, 16))
            sender.lcm.Publish(channel_of(side), image_message(*size, utime=round(1e6 * cycle * VISION_PERIOD)) + b"x")
        assert sender.host.step(0.0) == 1
    assert sender.host.counts["cycles"] == 3 and sender.host.counts["not_understood"] == 6
