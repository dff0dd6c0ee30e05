import time

import pytest
from pydrake.lcm import DrakeLcm

from drake_tracker.network.channels import channel_of
from drake_tracker.network.mailbox import Mailbox


class SlowBus:
    """Like DrakeLcm's UDP: of the messages that come between two looks it hands out the oldest of each channel."""

    def __init__(self):
        self.handlers, self.waiting = {}, {}

    def Subscribe(self, channel, handler):
        self.handlers[channel] = handler

    def Publish(self, channel, data):
        self.waiting.setdefault(channel, data)

    def HandleSubscriptions(self, timeout):
        for channel in list(self.waiting):
            self.handlers[channel](self.waiting.pop(channel))
        time.sleep(0.0005)


def numbers(messages):
    return [data[0] for _, data in messages]


def test_messages_are_handed_out_once_and_in_order():
    lcm = DrakeLcm("memq://")
    mailbox = Mailbox(lcm, {"point": 10, "camera_left": 10})
    assert mailbox.collect(0.0) == []
    for port, number in (("point", 1), ("camera_left", 2), ("point", 3)):
        lcm.Publish(channel_of(port), bytes([number]))
    lcm.Publish("ELSEWHERE", b"\x09")
    assert mailbox.collect(0.0) == [("point", b"\x01"), ("camera_left", b"\x02"), ("point", b"\x03")]
    assert mailbox.collect(0.0) == []


def test_while_listening_no_message_is_lost_however_fast_they_arrive():
    bus = SlowBus()
    mailbox = Mailbox(bus, {"point": 10})
    with mailbox.listening():
        for number in range(30):
            bus.Publish(channel_of("point"), bytes([number]))
            while bus.waiting:
                time.sleep(0.0001)
        came = numbers(mailbox.collect(5.0))
        assert mailbox.collect(0.01) == []
    assert came == list(range(30))


def test_listening_ends_with_an_exception():
    bus = SlowBus()
    mailbox = Mailbox(bus, {"point": 10})
    with pytest.raises(ZeroDivisionError), mailbox.listening():
        raise ZeroDivisionError
    bus.Publish(channel_of("point"), b"\x01")
    time.sleep(0.01)
    assert bus.waiting and numbers(mailbox.collect(0.0)) == [1]
