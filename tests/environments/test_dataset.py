"""Tests of the data sets for LeRobot: content, statistics, continuing, and what is refused."""

import errno
import json
import shutil
import sys
from pathlib import Path

import av
import numpy as np
import pandas
import pyarrow.parquet
import pytest

from drake_tracker import cli, load_scenario
from drake_tracker.commands.common import locked
from drake_tracker.environments import ControllerPolicy, TrackerEnvironment, make_policy, run_episode
from drake_tracker.environments import dataset_format as lerobot

MEASURED = "vision=!Measured {}"
SHORT = ["train", "--no-images", "--set", "duration=0.6", "--policy", "1991", "--inference-time", "0.05"]
PERIOD = 0.03


def dataset(out, *arguments, episodes=2, base=SHORT):
    return cli.main(["dataset", *base, "--episodes", str(episodes), "--out", str(out), *arguments])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "set"
    assert dataset(out) == 0
    return out


@pytest.fixture
def copied(recorded, tmp_path):
    return Path(shutil.copytree(recorded, tmp_path / "set"))


def read(out):
    """A small reader of the format: (info, {feature: array of all frames}, rows of the episodes)."""
    info = json.loads((out / "meta" / "info.json").read_text())
    parts, episodes = [], []
    for path in sorted((out / "meta" / "episodes").glob("*/*.parquet")):
        episodes += pandas.read_parquet(path).to_dict("records")
    for row in episodes:
        place = {"chunk_index": row["data/chunk_index"], "file_index": row["data/file_index"]}
        table = pyarrow.parquet.read_table(out / info["data_path"].format(**place))
        parts.append({name: np.array(table[name].to_pylist()) for name in table.column_names})
        assert len(table) == row["length"] == row["dataset_to_index"] - row["dataset_from_index"]
    return info, {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}, episodes


def content(out):
    """{path: bytes} of all files except the totals."""
    return {path.relative_to(out): path.read_bytes() for path in out.rglob("*.parquet")}


def test_the_columns_are_what_the_policy_observed_and_did(recorded):
    info, columns, episodes = read(recorded)
    env = TrackerEnvironment("train", [MEASURED, "duration=0.6"], inference_time=0.05)
    steps = []
    run_episode(env, make_policy("1991", env), 1, lambda *step: steps.append(step))
    second = {name: values[columns["episode_index"] == 1] for name, values in columns.items()}
    for k, (seen, action, outcome) in enumerate(steps):
        state = np.concatenate([seen["arm_state"], seen["tool"], seen["jaws"]])
        np.testing.assert_array_equal(second["observation.state"][k], np.float32(state))
        measured = np.concatenate([seen["point"].ravel(), seen["seen"]])
        np.testing.assert_array_equal(second["observation.environment_state"][k], np.float32(measured))
        np.testing.assert_allclose(second["action"][k], np.clip(action, env.action_space.low, env.action_space.high))
        assert second["busy"][k] == outcome["busy"] and second["next.reward"][k] == outcome["reward"]
    assert second["busy"].tolist()[:4] == [False, True, False, True] and len(steps) == len(second["index"]) == 20
    np.testing.assert_allclose(second["timestamp"], PERIOD * np.arange(20), atol=1e-6)
    assert second["next.done"].tolist() == [False] * 19 + [True] and not second["next.success"].any()
    assert columns["index"].tolist() == list(range(40)) and second["frame_index"].tolist() == list(range(20))
    assert [row["seed"] for row in episodes] == [0, 1] and not any(row["success"] for row in episodes)
    assert info["features"]["observation.state"]["names"][12:16] == ["tool.x", "tool.y", "tool.z", "tool.yaw"]
    assert info["features"]["observation.environment_state"]["names"][6] == "point.stamp.1"


def test_every_feature_is_described(recorded):
    info, columns, _ = read(recorded)
    schema = pyarrow.parquet.read_schema(recorded / "data" / "chunk-000" / "file-000.parquet")
    assert set(schema.names) == set(info["features"])
    for name, feature in info["features"].items():
        kind = schema.field(name).type
        assert columns[name].shape[1:] == (tuple(feature["shape"]) if feature["shape"] != [1] else ())
        assert str(getattr(kind, "value_type", kind)).replace("float", "float32") == feature["dtype"]
        assert feature["names"] is None or len(feature["names"]) == feature["shape"][0]
    assert info["fps"] == pytest.approx(1 / PERIOD) and info["splits"] == {"train": "0:2"}
    assert (info["total_episodes"], info["total_frames"], info["video_path"]) == (2, 40, None)
    tasks = pandas.read_parquet(recorded / "meta" / "tasks.parquet")
    assert tasks.iloc[0].name == "Lift the moving train." and tasks.task_index.tolist() == [0]


def test_the_statistics_are_those_of_all_frames(recorded):
    _, columns, episodes = read(recorded)
    statistics = json.loads((recorded / "meta" / "stats.json").read_text())
    assert set(statistics) == set(columns)
    for name, values in columns.items():
        values = values.reshape(40, -1).astype(float)
        for key in ("min", "max", "mean", "std"):
            np.testing.assert_allclose(statistics[name][key], getattr(np, key)(values, axis=0), rtol=1e-9, atol=1e-12)
        parts = np.quantile(values.reshape(2, 20, -1), 0.9, axis=1)
        np.testing.assert_allclose(statistics[name]["q90"], parts.mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(episodes[1][f"stats/{name}/q90"], parts[1], atol=1e-12)
        assert statistics[name]["count"] == [40]


def test_statistics_of_episodes_of_different_length_are_joined():
    values = np.random.default_rng(1).normal(size=(30, 4))
    found = lerobot.joined([lerobot.statistics_of(values[:7]), lerobot.statistics_of(values[7:])])
    np.testing.assert_allclose(found["std"], values.std(axis=0))
    np.testing.assert_allclose(found["mean"], values.mean(axis=0))
    assert found["count"].tolist() == [30]


def test_settings_and_versions_are_in_the_data_set(recorded):
    plan = json.loads((recorded / "meta" / "drake_tracker.json").read_text())
    wanted = {"scenario": "train", "overrides": ["duration=0.6"], "policy": "1991", "images": False, "episodes": 2}
    wanted |= {"inference_time": 0.05, "link_delay": 0.0, "first_seed": 0, "privileged": False}
    assert plan.items() >= wanted.items() and plan["package_versions"]["drake"]
    again = load_scenario(str(recorded / "meta" / "drake_tracker.yaml"))
    assert again.with_settings({"name": "train"}) == load_scenario("train", 0, overrides=[MEASURED, "duration=0.6"])


def test_an_interrupted_data_set_is_continued_as_if_it_had_not_been(recorded, tmp_path, monkeypatch, capsys):
    out, act, calls = tmp_path / "set", ControllerPolicy.act, []

    def interrupted(self, observation):
        calls.append(observation)
        if len(calls) == 15:  # in the second episode
            raise KeyboardInterrupt
        return act(self, observation)

    monkeypatch.setattr(ControllerPolicy, "act", interrupted)
    assert dataset(out) == 130
    assert "finished episodes are kept" in capsys.readouterr().err
    assert read(out)[0]["total_episodes"] == 1
    (out / "data" / "chunk-000" / ".file-001.0123abcd.parquet").write_text("by a killed process")
    (out / "data" / "chunk-000" / "file-001.parquet").write_text("without its row of metadata")
    kept = (out / "data" / "chunk-000" / "file-000.parquet").stat().st_mtime_ns
    assert dataset(out) == 0
    err = capsys.readouterr().err
    assert "episode 2 of 2, seed 1, 20 frames: failure, the time was over" in err and "episode 1" not in err
    assert content(out) == content(recorded)
    assert (out / "data" / "chunk-000" / "file-000.parquet").stat().st_mtime_ns == kept


def test_a_missing_gymnasium_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    assert dataset(tmp_path / "set") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "gymnasium cannot be loaded" in line and "drake-tracker[dataset]" in line
    assert not (tmp_path / "set").exists()


def test_a_full_disk_is_one_line_and_costs_no_finished_episode(copied, monkeypatch, capsys):
    before, write = content(copied), pyarrow.parquet.write_table

    def full(table, path):
        write(table, path)
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(pyarrow.parquet, "write_table", full)
    assert dataset(copied, episodes=3) == 2
    assert capsys.readouterr().err.endswith("file-002.parquet: cannot be written: No space left on device\n")
    assert content(copied) == before and read(copied)[0]["total_episodes"] == 2


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--episodes", "0"], "--episodes 0: must be a whole number from 1"),
        (["--episodes", "1"], "it has 2 episodes, not 1; the number can only grow"),
        (["--first-seed", "-1"], "--first-seed -1: seeds must be from 0 to"),
        (["--policy", "best"], "there is no policy 'best' for the train; the names are 1991, guided"),
        (["--policy", "guided"], "holds another data set: its policy is 1991, not guided"),
        (["--set", "track.speed=0.1"], "holds another data set: its overrides is"),
        (["--link-delay", "0.1"], "its link delay is 0.0, not 0.1"),
        (["--link-delay", "-1"], "link_delay must be a time in seconds, 0 or more"),
        (["--camera-lag", "0.01"], "camera_lag = 0.01 s is 0.600 cycles"),
    ],
)
def test_another_command_is_refused_in_one_line_and_changes_nothing(copied, capsys, arguments, said):
    before = content(copied)
    assert dataset(copied, *arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("drake-tracker: ") and said in line
    assert content(copied) == before


def test_other_folders_and_damaged_data_sets_are_refused(copied, tmp_path, capsys):
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    (tmp_path / "file").write_text("")
    first = copied / "meta" / "episodes" / "chunk-000" / "file-000.parquet"
    assert dataset(other) == 2 and dataset(tmp_path / "file") == 2
    data = first.read_bytes()
    first.unlink()
    assert dataset(copied) == 2
    first.write_bytes(data[:100])
    assert dataset(copied) == 2
    no_text = pyarrow.array([b"\xf3"], pyarrow.binary()).view(pyarrow.string())
    pyarrow.parquet.write_table(pyarrow.table({"tasks": no_text}), first)
    assert dataset(copied) == 2
    lines = capsys.readouterr().err.splitlines()
    said = (
        "other is not empty and holds no data set",
        "cannot be made",
        "an episode is missing",
        "000.parquet: damaged",
        "000.parquet: damaged",
    )
    assert len(lines) == 5 and all(words in line for words, line in zip(said, lines))
    assert [path.name for path in other.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    "change",
    [
        lambda table: table.drop(columns=["dataset_to_index"]),
        lambda table: table.drop(columns=["stats/action/count"]),
        lambda table: table.assign(**{"stats/action/mean": ["high"]}),
    ],
)
def test_a_row_that_is_not_of_this_package_is_refused_and_changes_nothing(copied, capsys, change):
    last = copied / "meta" / "episodes" / "chunk-000" / "file-001.parquet"
    change(pandas.read_parquet(last)).to_parquet(last)
    before = content(copied)
    plan = (copied / "meta" / "drake_tracker.json").read_text()
    assert dataset(copied, episodes=3) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "meta/episodes: damaged" in line
    assert content(copied) == before and (copied / "meta" / "drake_tracker.json").read_text() == plan


def test_two_processes_do_not_write_to_one_data_set(copied, capsys):
    with locked(copied, "it"):
        assert dataset(copied, episodes=3) == 2
    assert "set is in use: another drake-tracker writes to it" in capsys.readouterr().err
    assert read(copied)[0]["total_episodes"] == 2


def test_nothing_is_left_where_nothing_can_be_recorded(tmp_path, monkeypatch, capsys):
    base = ["ball", "--no-images", "--policy", "1991"]
    assert dataset(tmp_path / "set", base=base) == 2
    assert "--no-images: vision" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert dataset(tmp_path / "set") == 2
    assert "pip install 'drake-tracker[dataset]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_success_is_marked_and_the_truth_is_no_observation(tmp_path):
    base = ["train:guided", "--no-images", "--set", "track.speed=0.05", "--policy", "truth", "--first-seed", "2"]
    assert dataset(tmp_path / "set", base=base, episodes=1) == 0
    info, columns, (row,) = read(tmp_path / "set")
    assert row["success"] and row["reason"] == "the train was lifted" and row["seed"] == 2
    assert columns["next.success"][-1] and columns["next.reward"].sum() == 1.0
    assert info["features"]["privileged.truth"]["names"][4] == "truth.x"
    assert not any("truth" in name for name in info["features"] if name.startswith("observation"))


def test_videos_have_a_frame_for_each_row(tmp_path):
    base = ["train", "--set", "duration=0.3", "--policy", "1991", "--camera-lag", "0.05"]
    assert dataset(tmp_path / "set", base=base, episodes=1) == 0
    info, columns, (row,) = read(tmp_path / "set")
    statistics = json.loads((tmp_path / "set" / "meta" / "stats.json").read_text())
    for side in ("left", "right"):
        key = f"observation.images.camera_{side}"
        path = info["video_path"].format(video_key=key, chunk_index=0, file_index=row[f"videos/{key}/file_index"])
        with av.open(str(tmp_path / "set" / path)) as video:
            frames = list(video.decode(video=0))
        images = np.array([frame.to_ndarray(format="rgb24") for frame in frames])
        assert images.shape == (10, *info["features"][key]["shape"])
        np.testing.assert_allclose([frame.time for frame in frames], columns["timestamp"], atol=1e-4)
        assert row[f"videos/{key}/to_timestamp"] == pytest.approx(0.3)
        np.testing.assert_allclose(np.ravel(statistics[key]["mean"]), images.mean(axis=(0, 1, 2)) / 255, atol=0.02)
        assert np.shape(statistics[key]["q50"]) == (3, 1, 1) and statistics[key]["count"] == [10]
        ages = columns[f"observation.camera_{side}_age"]
        assert ages.shape == (10, 2) and (ages[-1] >= 0.0).all() and images[-1].mean() > 10.0
