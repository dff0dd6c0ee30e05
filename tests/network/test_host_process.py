"""The host's process on points that a test sends to it."""

import numpy as np
import pytest
from drake import lcmt_drake_signal, lcmt_header, lcmt_image, lcmt_image_array
from pydrake.lcm import DrakeLcm

from drake_tracker import load_scenario
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Prediction, TrackPoint
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.network.channels import channel_of
from drake_tracker.network.signal_message import decode_signal, encode_signal
from drake_tracker.run.host_process import MOST_WAITING, SILENCE, HostProcess

LAG = 0.25


class Sender:
    """Stands for the arm's process: sends points on a circle, and keeps the packets that come back."""

    def __init__(self, overrides=("vision=!Measured {}",)):
        self.lcm = DrakeLcm("memq://")
        self.scenario = load_scenario("train", overrides=list(overrides))
        self.news, self.packets, self.wall = [], [], 0.0
        self.lcm.Subscribe(channel_of("prediction"), self._keep)
        self.host = self.new_host()

    def new_host(self):
        return HostProcess(self.scenario, self.lcm, self.lcm, tell=self.news.append, clock=lambda: self.wall)

    def _keep(self, data):
        self.packets.append(Prediction(decode_signal(lcmt_drake_signal.decode(data), Prediction.get_fields())))

    def send(self, cycles):
        for cycle in cycles:
            stamp, angle = cycle * VISION_PERIOD - LAG, cycle * VISION_PERIOD * 0.15 / 0.15
            point = [stamp, 0.56 + 0.15 * np.cos(angle), 0.15 * np.sin(angle), 0.48, 0.001, 1.0]
            message = encode_signal(point, TrackPoint.get_fields(), cycle * VISION_PERIOD + 0.0008)
            self.lcm.Publish(channel_of("point"), message.encode())
            self.host.step(timeout=0.0)
        self.lcm.HandleSubscriptions(0)

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


@pytest.mark.parametrize("garbage", [b"", b"\x00" * 40, lcmt_image_array().encode()])
def test_garbage_on_the_bus_does_not_end_the_host(garbage):
    sender = Sender()
    sender.lcm.Publish(channel_of("point"), garbage)
    sender.lcm.Publish(channel_of("point"), encode_signal([1.0], ["altitude"], 0.0).encode())
    sender.send(range(1, 90))
    assert sender.packets[-1].valid and sender.host.counts["not_understood"] == 1


def test_images_of_another_scenario_are_refused_in_one_line():
    sender = Sender(overrides=())
    image = lcmt_image()
    image.header, image.width, image.height = lcmt_header(), 32, 16
    images = lcmt_image_array()
    images.header, images.num_images, images.images = lcmt_header(), 1, [image]
    sender.lcm.Publish(channel_of("camera_left"), images.encode())
    with pytest.raises(
        DrakeTrackerError, match="DRAKE_TRACKER_CAMERA_LEFT: the image has 32 x 16 px, but this scenario"
    ):
        sender.host.step(0.0)
