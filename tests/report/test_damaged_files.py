"""Damaged or made-up run directories: `view` shows a page or refuses in one line, and writes that page only."""

import dataclasses
import json
import os
import random

import numpy as np
import pytest

from drake_tracker import cli
from drake_tracker.core.log import STREAM_FILE, LogStream, load_log, save_log
from drake_tracker.report.page import page_of
from drake_tracker.report.run_files import read_run
from drake_tracker.report.server import make_server

WRONG = [
    *(True, 0, -1, 10**400, 1e308, float("nan"), float("inf"), "", "x" * 100_000, "\ud800", "\x1b[31m", [], [1], {}),
    *({"max": "x"}, {"max": [1]}, {"drake_tracker": {}}, {"drake_tracker": 9}, {"": ""}),
]
KEYS = [
    *("scenario", "seed", "success", "failure_reason", "attempts", "prediction_rms_m", "lag_s", "package_versions"),
    *("time_to_grasp_s", "simulated_s", "speed_share", "interrupted", "wall_time_s", "git_commit"),
]
NUMBERS = [np.nan, np.inf, -np.inf, 1e308, 1e18, -1.0, 0.0, 1e-320, 2.0**63, 12345.678]


@pytest.fixture
def view(monkeypatch, capsys):
    """Runs ``view`` without waiting; returns (exit code, lines on standard output, lines on standard error)."""
    monkeypatch.setattr("drake_tracker.core.processes.loopback_server.LoopbackServer.serve_forever", lambda _: None)

    def run(folder):
        code = cli.main(["view", str(folder), "--no-browser", "--port", "0"])
        printed = capsys.readouterr()
        return code, printed.out.splitlines(), printed.err.splitlines()

    return run


@pytest.mark.parametrize("wrong", WRONG, ids=lambda value: f"{value!a:.30}")
def test_wrong_values_in_a_summary_are_left_out(run_folder, wrong):
    (run_folder / "summary.json").write_text(json.dumps(dict.fromkeys(KEYS, wrong)))
    text = page_of(read_run(run_folder))
    assert "Phases" in text and "x" * 100_000 not in text and text.encode()


def test_wrong_values_in_a_summary_are_named(run_folder):
    wrong = {"success": "maybe", "lag_s": [1], "prediction_rms_m": float("nan"), "seed": 0.5, "package_versions": ["a"]}
    (run_folder / "summary.json").write_text(json.dumps(wrong))
    text = page_of(read_run(run_folder))
    assert "wrong values, which are not shown: prediction_rms_m, seed, success, lag_s, package_versions." in text
    assert "no verdict" in text


@pytest.mark.parametrize(
    "content, reason",
    [
        (b"\xff\xfe\x00", "this is not JSON"),
        (b"[" * 100_000, "nested too deeply"),
        (b"", "this is not JSON"),
        (b"null", "not a mapping"),
        (b" " * (1 << 24) + b"{}", "more than 16384 KiB"),
    ],
)
def test_a_file_that_is_no_summary_is_noted(run_folder, content, reason):
    (run_folder / "summary.json").write_bytes(content)
    (note,) = (note for note in read_run(run_folder).notes if note.startswith("summary.json cannot be read"))
    assert reason in note and "\n" not in note


def damaged(log, generator):
    """Returns a copy of a log in which some of the numbers, samples or signals are damaged or missing."""
    log = dict(log)
    for name in generator.sample(sorted(log), 3):
        signal = log[name]
        times, data = signal.times.copy(), signal.data.copy()
        column, value = generator.randrange(data.shape[1]), generator.choice(NUMBERS)
        kind = generator.randrange(7)
        if kind == 0:
            del log[name]
            continue
        if kind == 1:
            data[generator.randrange(len(data)), column] = value
        elif kind == 2:
            data[:, column] = value
        elif kind == 3:
            data *= generator.choice([0.0, -1.0, 1e10, 1e200])
        elif kind == 4:
            times *= generator.choice([0.0, 1e-300, 1e3, 1e4])
        else:
            count = generator.choice([0, 1, 2, generator.randrange(len(times))])
            times, data = times[:count], data[:count]
        log[name] = dataclasses.replace(signal, times=times, data=data)
    return log


@pytest.mark.parametrize("seed", range(12))
def test_any_numbers_in_a_log_give_a_page(run_folder, made_up, seed):
    save_log(damaged(made_up[1], random.Random(seed)), run_folder / "log.npz")
    text = page_of(read_run(run_folder))
    assert "12.3 mm" in text and 'src="cameras.mp4"' in text


@pytest.mark.parametrize("phase", [99.0, -1.0, np.nan, 1e300])
def test_an_unknown_phase_costs_only_what_needs_the_phases(run_folder, made_up, phase):
    log = dict(made_up[1])
    data = log["command"].data.copy()
    data[len(data) // 2, log["command"].names.index("phase")] = phase
    save_log({**log, "command": dataclasses.replace(log["command"], data=data)}, run_folder / "log.npz")
    run = read_run(run_folder)
    assert "12.3 mm" in page_of(run)
    assert any(note.startswith("The phases cannot be shown, because the log lacks") for note in run.notes)


@pytest.mark.parametrize("scale", [1e7, 1e300])
def test_a_log_with_times_of_no_run_is_noted(run_folder, made_up, scale):
    log = {name: dataclasses.replace(signal, times=scale * signal.times) for name, signal in made_up[1].items()}
    save_log(log, run_folder / "log.npz")
    assert any("are not those of a run" in note for note in read_run(run_folder).notes)


def test_a_killed_run_has_the_same_page_but_for_its_summary(run_folder):
    log = load_log(run_folder / "log.npz")
    stream = LogStream(run_folder / STREAM_FILE, {name: signal.names for name, signal in log.items()})
    stream.append({name: (signal.times, signal.data) for name, signal in log.items()})
    stream.close()
    (run_folder / "log.npz").unlink()
    (run_folder / "summary.json").unlink()
    run = read_run(run_folder)
    text = page_of(run)
    assert "attempt 1: missed" in text and f'href="{STREAM_FILE}"' in text and "no verdict" in text
    assert f"The signals are those of {STREAM_FILE}, up to {log['point'].times[-1]:.1f} s." in run.notes


def test_the_page_is_not_written_through_a_link(run_folder, view):
    precious = run_folder.parent / "precious"
    precious.write_text("precious")
    (run_folder / "report.html").symlink_to(precious)
    code, lines, errors = view(run_folder)
    assert (code, errors) == (0, []) and lines[-1].startswith("http://127.0.0.1:")
    assert precious.read_text() == "precious" and "Phases" in (run_folder / "report.html").read_text()


@pytest.mark.parametrize("name", ["summary.json", "log.npz", "scenario.yaml", "report.html", "cameras.mp4"])
@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: os.symlink("/dev/zero", path)])
def test_a_pipe_a_folder_and_a_device_in_place_of_a_file_do_not_block(run_folder, view, name, make):
    (run_folder / name).unlink(missing_ok=True)
    make(run_folder / name)
    before = sorted(run_folder.parent.rglob("*"))
    code, lines, errors = view(run_folder)
    assert (code, errors) == (0, []) and lines[-1].startswith("http://127.0.0.1:")
    assert set(run_folder.parent.rglob("*")) - set(before) <= {run_folder / "report.html"}


def test_what_is_printed_has_no_control_characters(run_folder, view):
    np.savez(run_folder / "log.npz", **{"\x1b[31m": np.zeros(3), "\x1b[31m.time": np.zeros(2), "\x1b[31m.names": "x"})
    code, lines, _ = view(run_folder)
    assert code == 0 and "\\x1b[31m has samples of shape" in "".join(lines) and "\x1b" not in "".join(lines)


def test_a_file_that_becomes_a_pipe_is_not_served(run_folder):
    with make_server("", run_folder, ["cameras.mp4"], 0) as server:
        handler = server.RequestHandlerClass.__new__(server.RequestHandlerClass)
        refused = []
        handler.refuse = lambda status, reason: refused.append(status)
        (run_folder / "cameras.mp4").unlink()
        os.mkfifo(run_folder / "cameras.mp4")
        handler._send_file(run_folder / "cameras.mp4")
    assert refused == [404]
