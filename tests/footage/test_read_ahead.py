import threading
import time

import pytest

from drake_tracker.footage.read_ahead import read_ahead


def threads():
    return [thread for thread in threading.enumerate() if thread.name == "read-ahead"]


def test_items_arrive_in_order_and_few_wait():
    made = []

    def numbers():
        for k in range(50):
            made.append(k)
            yield k

    ahead = read_ahead(numbers, 3)
    for expected in range(50):
        assert next(ahead) == expected
        assert len(made) <= expected + 5  # three wait, one is here, one is being handed over
    assert next(ahead, None) is None
    assert not threads()


def test_an_error_comes_after_the_items_before_it():
    def broken():
        yield 1
        yield 2
        raise ValueError("no more")

    ahead = read_ahead(broken, 8)
    assert [next(ahead), next(ahead)] == [1, 2]
    with pytest.raises(ValueError, match="no more"):
        next(ahead)
    assert not threads()


def test_a_reader_that_stops_ends_the_thread_and_its_iterator():
    closed = threading.Event()

    def endless():
        try:
            while True:
                yield 0
        finally:
            closed.set()

    ahead = read_ahead(endless, 2)
    next(ahead)
    ahead.close()
    assert not threads()
    for _ in range(100):
        if closed.is_set():
            break
        time.sleep(0.01)
    assert closed.is_set()
