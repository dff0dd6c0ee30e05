"""Tests of replays: bit-identical to the run until a setting is changed."""

import json
import re
import shutil

import numpy as np
import pytest

from drake_tracker import cli
from drake_tracker.core.log import Signal, load_log, save_log
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, OperatorCommand, message_size, pack_prediction
from drake_tracker.replay.judge import HORIZONS, Judge, compare_signals
from drake_tracker.replay.parts import make_replay_diagram
from drake_tracker.replay.recording import STARTS, open_recording
from drake_tracker.replay.replay import replay_run

FROM_POINTS = {"filtered", "prediction", "delivered", "packet_report", "target"}
OF_SEVERAL = {"tracks", "regions_left", "regions_right"}
CENTROIDS = {"train": {"centroid_left", "centroid_right"}, "ball": {"centroid"}}


@pytest.mark.parametrize(
    "name, task, start",
    [("measured_run", "train", "points")]
    + [(f"{name}_run", task, start) for name, task in (("rendered", "train"), ("ball", "ball")) for start in STARTS],
)
def test_signals_are_bit_identical_without_changes(request, name, task, start):
    recording = open_recording(request.getfixturevalue(name), start=start)
    result = replay_run(recording)
    expected = FROM_POINTS | ({"point"} if start != "points" else set())
    expected |= CENTROIDS[task] if start == "images" else set()
    assert set(result["signals"]) == expected
    assert result["identical"], result["signals"]
    assert result["replayed"] == result["recorded"] and None not in result["recorded"].values()
    # The replay did run: there are packets, the last one near the end.
    delivered = recording.log["delivered"]
    assert delivered["valid"][-1] and delivered["seq"][-1] > 5 and recording.end - delivered["stamp"][-1] < 0.5


@pytest.mark.parametrize("start", ["images", "points"])
def test_a_run_with_several_objects_is_bit_identical(several_run, start):
    recording = open_recording(several_run, start=start)
    result = replay_run(recording)
    expected = FROM_POINTS | (CENTROIDS["train"] | OF_SEVERAL | {"point"} if start == "images" else set())
    assert set(result["signals"]) == expected and result["identical"], result["signals"]
    assert result["replayed"] == result["recorded"] and None not in result["recorded"].values()
    tracks = recording.log["tracks"]
    assert tracks["number0"][-1] > 0.0 and tracks["number1"][-1] > 0.0
    assert open_recording(several_run).start == "points"


def test_the_operator_selects_the_target_again(several_run, tmp_path):
    log = load_log(several_run / "log.npz")
    tracks = log["tracks"]
    before, other = tracks["target"][-1], tracks["number1"][-1]
    assert {before, other} == {1.0, 2.0} and len(set(tracks["target"])) == 2, "0 and the first object seen"
    from_sample = len(tracks.times) - 30
    commands = np.zeros((len(tracks.times), message_size(OperatorCommand)))
    commands[from_sample:, OperatorCommand.get_fields().index("selected")] = other
    log["operator"] = Signal(tracks.times, commands, tuple(OperatorCommand.get_fields()))
    folder = tmp_path / "run"
    shutil.copytree(several_run, folder)
    save_log(log, folder / "log.npz")

    out = tmp_path / "replay"
    out.mkdir()
    result = replay_run(open_recording(folder, start="images"), out)
    target = load_log(out / "log.npz")["tracks"]["target"]
    assert np.array_equal(target[:from_sample], tracks["target"][:from_sample])
    assert (target[from_sample:] == other).all(), "in the cycle in which the operator's command was logged"
    assert not result["identical"], "the run itself had no such command"


@pytest.mark.parametrize(
    "start, change",
    [
        ("points", "estimator=!AlphaBetaGamma {}"),
        ("images", "vision.method.silhouettes.threshold=25"),
        ("images", "vision.method=!MotionCentroid {}"),
    ],
)
def test_a_change_of_a_run_with_several_objects(several_run, start, change):
    result = replay_run(open_recording(several_run, [change], start))
    assert not result["identical"] and result["signals"]["prediction"]["greatest_difference"] > 0.0


def test_the_default_start_is_centroids_or_otherwise_points(measured_run, rendered_run):
    assert open_recording(measured_run).start == "points"
    assert open_recording(rendered_run).start == "centroids"


def test_no_source_is_ground_truth(ball_run):
    recording = open_recording(ball_run)
    diagram = make_replay_diagram(recording)
    names = {system.get_name() for system in diagram.GetSystems()}
    assert names == {"recorded_centroid", "recorded_command", "projector", "host", "link", "packet_guard", "servo"}


@pytest.mark.parametrize(
    "start, change, same",
    [
        ("centroids", "estimator=!AlphaBetaGamma {}", {"point"}),
        ("centroids", "link=!Lossy {delay: 0.1}", {"point", "filtered", "prediction"}),
        ("centroids", "servo.tracking_index=0.5", {"point", "filtered", "prediction", "delivered"}),
        ("images", "vision.method.detector.centroid=mean", set()),
        ("images", "vision.lag_cycles=10", set()),
    ],
)
def test_a_change_affects_only_the_signals_downstream(rendered_run, start, change, same):
    result = replay_run(open_recording(rendered_run, [change], start))
    unchanged = {name for name, found in result["signals"].items() if found["identical"]}
    assert unchanged - {"packet_report"} == same  # packets may be others, and as many
    assert not result["identical"] and list(result["changes"])
    assert result["signals"]["target"]["greatest_difference"] > 0.0
    assert (result["replayed"] == result["recorded"]) == change.startswith("servo")


def test_the_command_writes_log_picture_and_numbers(rendered_run, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["replay", str(rendered_run), "--set", "estimator=!AlphaBetaGamma {}", "--out", str(out)]
    assert cli.main(arguments) == 0
    assert {path.name for path in out.iterdir()} == {"log.npz", "replay.json", "replay.png"}
    found = json.loads((out / "replay.json").read_text())
    assert found["changes"]["estimator"] == ["!ClosedPath", "!AlphaBetaGamma"]
    assert found["real_time_factor"] > 0.0 and found["simulated_s"] == 2.5
    log = load_log(out / "log.npz")
    assert set(log) == FROM_POINTS | {"point"}
    assert compare_signals(load_log(rendered_run / "log.npz"), log)["point"]["identical"]
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    key = "prediction_0.75_s_rms_m"
    pair = [f"{1e3 * found[which][key]:.2f}" for which in ("recorded", "replayed")]
    assert ["0.75", "s", "ahead", *pair] in rows and ["identical", "point"] in rows


def test_a_run_of_an_earlier_version_has_no_report_of_packets_and_is_replayed(measured_run, tmp_path):
    for name in ("scenario.yaml", "summary.json"):
        (tmp_path / name).write_text((measured_run / name).read_text())
    log = load_log(measured_run / "log.npz")
    assert log.pop("packet_report")["received"][-1] > 30
    save_log(log, tmp_path / "log.npz")
    scenario = tmp_path / "scenario.yaml"
    text, count = re.subn(r"^  guard:\n(    .*\n)+", "", scenario.read_text(), flags=re.MULTILINE)
    assert count == 1
    scenario.write_text(text)
    result = replay_run(open_recording(tmp_path))
    assert result["identical"] and set(result["signals"]) == FROM_POINTS - {"packet_report"}


def test_the_judge_agrees_with_the_summary_and_with_ground_truth(measured_run):
    recording = open_recording(measured_run)
    judge, log = Judge(recording.task, recording.recorded, recording.log), dict(recording.log)
    summary = json.loads((measured_run / "summary.json").read_text())
    assert judge.rms(log)["position_rms_m"] == pytest.approx(summary["position_rms_m"], abs=1e-6)

    signal = log["prediction"]
    rows = np.zeros_like(signal.data)
    for k, (stamp, seq, valid) in enumerate(signal.view("stamp", "seq", "valid")):
        knots = np.zeros((KNOT_COUNT, 5))
        times = np.minimum(stamp + KNOT_SPACING * np.arange(KNOT_COUNT), recording.end)
        knots[:, :2] = judge.true_xy(times) + [0.003, -0.004]
        rows[k] = pack_prediction(stamp, seq, knots) * valid
    log["prediction"] = Signal(signal.times, rows, signal.names)
    for horizon in HORIZONS:
        times, error = judge.ahead(log, horizon)
        known = times < recording.end - KNOT_SPACING
        assert np.count_nonzero(known) > 5
        np.testing.assert_allclose(error[known], 0.005, atol=2e-4)  # the path is linear between knots
