"""The stream of a log: whatever is cut off or damaged, the samples before it are read."""

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import LOG_FILE, STREAM_FILE, Signal, load_log, save_log
from drake_tracker.core.log_stream import MAGIC, LogStream

FIELDS = {"point": ("stamp", "x"), "empty": ("a", "b", "c"), "fast": ("q",)}
RECORDS = 2


def news(k):
    """Record ``k``: two points and six fast samples, so that both signals end at the same instant."""
    times, fast = k + np.array([0.5, 1.0]), k + np.arange(1, 7) / 6
    nothing = (np.zeros(0), np.zeros((0, 3)))
    return {"point": (times, np.column_stack([times, 10 * times])), "empty": nothing, "fast": (fast, fast[:, None])}


@pytest.fixture
def stream(tmp_path):
    written = LogStream(tmp_path / STREAM_FILE, FIELDS)
    sizes = [written.path.stat().st_size]
    for k in range(RECORDS):
        written.append(news(k))
        sizes.append(written.path.stat().st_size)
    written.close()
    return written.path, sizes


def test_what_is_streamed_is_read_back(stream):
    log = load_log(stream[0])
    assert {name: signal.names for name, signal in log.items()} == FIELDS
    np.testing.assert_array_equal(log["point"].times, 0.5 * np.arange(1, 2 * RECORDS + 1))
    np.testing.assert_array_equal(log["point"]["x"], 10 * log["point"].times)
    assert log["empty"].data.shape == (0, 3) and log["fast"].data.shape == (6 * RECORDS, 1)


def test_a_stream_that_is_cut_anywhere_is_read_up_to_its_last_complete_record(stream):
    path, sizes = stream
    whole = path.read_bytes()
    for size in range(len(whole) + 1):
        path.write_bytes(whole[:size])
        log = load_log(path)
        if size < sizes[0]:
            assert log == {}
            continue
        complete = sum(size >= end for end in sizes[1:])
        assert len(log["point"].times) == 2 * complete and len(log["fast"].times) == 6 * complete


def test_a_stream_that_is_damaged_anywhere_is_read_up_to_the_damage_or_refused_in_one_line(stream):
    path, sizes = stream
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        if place >= sizes[0]:
            assert len(load_log(path)["point"].times) == 2 * sum(place >= end for end in sizes[1:])
        elif place not in range(len(MAGIC), len(MAGIC) + 4):  # the length of the first record
            with pytest.raises(DrakeTrackerError, match=r"log\.part: this log is damaged or incomplete: it .*$"):
                load_log(path)


@pytest.mark.parametrize("tail", [bytes(100), b"\xff" * 100, b"\x08\x00\x00\x00"])
def test_what_a_loss_of_power_leaves_behind_is_not_read(stream, tail):
    path, _ = stream
    path.write_bytes(path.read_bytes() + tail)
    assert len(load_log(path)["point"].times) == 2 * RECORDS


def test_the_directory_of_a_run_has_the_log_or_else_the_stream(stream, tmp_path):
    assert len(load_log(tmp_path)["point"].times) == len(load_log(tmp_path / LOG_FILE)["point"].times) == 2 * RECORDS
    save_log({"point": Signal(np.zeros(1), np.zeros((1, 1)), ("x",))}, tmp_path / LOG_FILE)
    assert len(load_log(tmp_path)["point"].times) == 1
    with pytest.raises(DrakeTrackerError, match="other.npz: cannot be read: No such file"):
        load_log(tmp_path / "other.npz")


def test_a_record_that_cannot_be_written_is_removed_again(stream, tmp_path, monkeypatch):
    path = tmp_path / "second.part"
    second = LogStream(path, FIELDS)
    second.append(news(0))
    size = path.stat().st_size
    import os

    write = os.write

    def full(file, data):
        if len(data) < 20:
            raise OSError(28, "No space left on device")
        return write(file, data[: len(data) // 2])

    monkeypatch.setattr("drake_tracker.core.log_stream.os.write", full)
    with pytest.raises(OSError, match="No space left"):
        second.append(news(1))
    assert path.stat().st_size == size
    second.append(news(2))  # ignored: the stream ended
    assert path.stat().st_size == size
