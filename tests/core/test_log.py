"""Tests of the log."""

import inspect
import io
import os
import zipfile

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import LARGEST_LOG, LOG_FILE, MAGIC, STREAM_FILE, LogStream, Signal, load_log, save_log
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.run.log_recorder import add_loggers, read_log, tool_signal
from drake_tracker.tasks.train.task import TASK


class Clock(LeafSystem):
    """Has every port that is logged; all fields of a port show the time plus their index."""

    def __init__(self):
        super().__init__()
        for name, (_, fields) in TASK.signals().items():
            self.DeclareVectorOutputPort(name, len(fields), self._calc)

    @staticmethod
    def _calc(context, output):
        output.SetFromVector(context.get_time() + np.arange(output.size()))


@pytest.fixture(scope="module")
def log():
    builder = DiagramBuilder()
    clock = builder.AddSystem(Clock())
    loggers = add_loggers(builder, clock, TASK)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    return read_log(loggers, simulator.get_context(), TASK)


def test_every_signal_is_logged_at_its_period(log):
    assert set(log) == set(TASK.signals())
    for name, (period, fields) in TASK.signals().items():
        signal = log[name]
        np.testing.assert_allclose(signal.times, period * np.arange(len(signal.times)), atol=1e-9)
        assert len(signal.times) == int(0.1 / period + 1e-9) + 1
        assert signal.names == tuple(fields)


def test_fields_are_found_by_name(log):
    point = log["point"]
    np.testing.assert_allclose(point["stamp"], point.times)
    np.testing.assert_allclose(point["y"], point.times + 2)
    np.testing.assert_allclose(point.view("z", "x"), np.column_stack([point.times + 3, point.times + 1]))
    with pytest.raises(ValueError):
        point["nothing"]


def test_what_is_saved_is_loaded(log, tmp_path):
    save_log(log, tmp_path / "log.npz")
    loaded = load_log(tmp_path / "log.npz")
    assert set(loaded) == set(log)
    for name, signal in log.items():
        assert loaded[name].names == signal.names
        np.testing.assert_array_equal(loaded[name].times, signal.times)
        np.testing.assert_array_equal(loaded[name].data, signal.data)


def test_a_log_that_contains_text_is_rejected_as_damaged(tmp_path):
    words = np.array([["one"]])
    np.savez(tmp_path / "log.npz", **{"point": words, "point.time": np.zeros(1), "point.names": np.array(["x"])})
    with pytest.raises(DrakeTrackerError, match="log.npz: this log is damaged.*not numbers"):
        load_log(tmp_path / "log.npz")


def test_tool_comes_from_forward_kinematics():
    model = make_arm_model(PUMA560)
    X_WT = tool_down((0.6, 0.1, 0.7), 0.4)
    q = joints_for(model, PUMA560.q_start, X_WT)
    times = TIME_STEP * np.arange(11)
    state = Signal(times, np.tile(np.concatenate([q, np.zeros(6)]), (11, 1)), TASK.signals()["arm_state"][1])
    tool = tool_signal(state, model)
    np.testing.assert_allclose(tool.times, [0.0, 1 / 60, 2 / 60], atol=1e-9)
    np.testing.assert_allclose(tool.data, np.tile([0.6, 0.1, 0.7, 0.4], (3, 1)), atol=1e-5)


def archive(path, **changes):
    """Writes a log with one signal, some of its arrays replaced."""
    arrays = {"point": np.zeros((3, 2)), "point.time": np.arange(3.0), "point.names": np.array(["x", "y"])}
    np.savez(path, **{name: array for name, array in (arrays | changes).items() if array is not None})


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"point": np.zeros((2, 2))}, "samples of shape"),
        ({"point": np.zeros((3, 2, 1))}, "samples of shape"),
        ({"point.time": np.zeros((3, 1))}, "samples of shape"),
        ({"point.names": np.array(["x", "y", "z"])}, "samples of shape"),
        ({"point.names": np.array(["x", "x"])}, "without names of their own"),
        ({"point.names": np.array([1, 2])}, "without names of their own"),
        ({"point.time": np.array([0.0, np.nan, 1.0])}, "times that are not finite"),
        ({"point.time": np.array([0.0, 2.0, 1.0])}, "not in order"),
        ({"point.time": None}, "point.time"),
        ({"point": np.array([{}, {}, {}], dtype=object)}, "has the type object"),
        ({"point": np.zeros((3, 2), complex)}, "not numbers"),
    ],
)
def test_arrays_that_do_not_fit_together_are_one_line(tmp_path, changes, said):
    archive(tmp_path / "log.npz", **changes)
    with pytest.raises(DrakeTrackerError, match=f"log.npz: this log is damaged or incomplete: .*{said}") as caught:
        load_log(tmp_path / "log.npz")
    assert "\n" not in str(caught.value)


def test_an_array_that_promises_more_than_there_is_is_not_allocated(tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**13,)})
    with zipfile.ZipFile(tmp_path / "log.npz", "w") as file:
        file.writestr("point.npy", header.getvalue())
    with pytest.raises(DrakeTrackerError, match="does not have the size that it states"):
        load_log(tmp_path / "log.npz")


def test_a_log_that_unpacks_to_more_than_is_allowed_is_refused_before_it_is_unpacked(tmp_path):
    zeros = np.zeros((10**6, 2))
    np.savez_compressed(tmp_path / "log.npz", **{"point": zeros, "point.time": zeros[:, 0]})
    assert (tmp_path / "log.npz").stat().st_size < 10**5
    with pytest.raises(DrakeTrackerError, match="more than the 1000000 that are read"):
        load_log(tmp_path / "log.npz", most=10**6)


def test_a_pipe_in_place_of_a_log_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "log.npz")
    with pytest.raises(DrakeTrackerError, match="it is not a regular file"):
        load_log(tmp_path)


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

    monkeypatch.setattr("drake_tracker.core.log.os.write", full)
    with pytest.raises(OSError, match="No space left"):
        second.append(news(1))
    assert path.stat().st_size == size
    second.append(news(2))  # ignored: the stream ended
    assert path.stat().st_size == size


def test_each_reader_of_logs_has_the_same_limit():
    assert inspect.signature(load_log).parameters["most"].default == LARGEST_LOG < 1 << 32
