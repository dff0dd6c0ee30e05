import threading

import pytest

from drake_tracker.core.processes.worker_thread import WorkerThread


def test_everything_is_done_in_order():
    done = []
    background = WorkerThread(done.append, 2)
    for k in range(100):
        background.put(k)
    background.close()
    background.close()
    assert done == list(range(100))


def test_put_waits_while_too_much_is_waiting():
    go, done = threading.Event(), []

    def work(item):
        go.wait(5.0)
        done.append(item)

    background = WorkerThread(work, 2)
    background.put(0)
    background.put(1)
    late = threading.Thread(target=background.put, args=(2,))
    late.start()
    late.join(0.05)
    assert late.is_alive()
    go.set()
    late.join(5.0)
    background.close()
    assert done == [0, 1, 2]


def test_an_error_is_raised_once_and_ends_the_work():
    def work(item):
        if item == 1:
            raise OSError("full")
        assert item == 0

    background = WorkerThread(work, 8)
    background.put(0)
    background.put(1)
    with pytest.raises(OSError, match="full"):
        background.close()
    background.close()
