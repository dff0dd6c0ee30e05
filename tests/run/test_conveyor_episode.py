"""A closed loop of the conveyor: the arm picks parts from the belt and places them in the tray."""

import json

import numpy as np
import pytest
from methods.part_vision_errors import vision_errors

from drake_tracker import load_scenario, simulate
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import PART_FIELDS, PartTracks, message_rows
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.replay.recording import open_recording
from drake_tracker.replay.replay import replay_run
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks.conveyor.setup import resolve
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.world.conveyor.part_fates import PartFate

DURATION, SEED = 9.0, 5


class Episode:
    def __init__(self, out, name="conveyor:measured", duration=DURATION, overrides=("arrivals.rate=20",), **options):
        self.out = out
        self.scenario = load_scenario(name, seed=SEED, duration=duration, overrides=list(overrides))
        self.summary = simulate(self.scenario, out, RunOptions(**options))
        self.log = load_log(out / "log.npz")


@pytest.fixture(scope="module")
def episode(tmp_path_factory):
    return Episode(tmp_path_factory.mktemp("conveyor") / "run")


def test_a_part_is_placed_and_nothing_else_is_touched(episode):
    summary = episode.summary
    assert summary["placed"] >= 1 and summary["dropped"] == summary["doubles"] == summary["misplaced"] == 0
    assert not (summary["belt_touched"] or summary["tray_touched"] or summary["table_touched"])
    assert not summary["self_touched"] and summary["joint_limit_margin_rad"] > 0.0
    assert summary["placement_rms_m"] < 0.006 and summary["packets_rejected"] == 0


def test_the_phases_of_a_pick_follow_each_other(episode):
    numbers = episode.log["command"]["phase"].astype(int)
    phases = [PickPhase(number) for number in numbers[np.flatnonzero(np.diff(numbers, prepend=-1))]]
    start = phases.index(PickPhase.INTERCEPT)
    assert phases[start : start + 7] == [
        PickPhase.INTERCEPT, PickPhase.CLOSE, PickPhase.LIFT, PickPhase.CARRY, PickPhase.LOWER, PickPhase.RELEASE,
        PickPhase.RAISE,
    ]  # fmt: skip


def test_the_log_has_the_state_of_every_part(episode):
    parts, states, fates = (
        resolve(episode.scenario).arrivals,
        episode.log["truth_part_states"],
        episode.log["truth_fates"],
    )
    assert states.names == tuple(f"{field}_{k}" for k in range(len(parts)) for field in BODY_STATE)
    assert fates.names == tuple(f"fate_{k}" for k in range(len(parts)))
    placed = [k for k in range(len(parts)) if fates.data[-1, k] == PartFate.PLACED]
    assert len(placed) == episode.summary["placed"]
    for k in placed:
        assert states[f"x_{k}"][-1] < 0.45 and abs(states[f"x_{k}"][0] - parts[k].x) < 1e-6


def test_parts_that_are_far_upstream_or_rest_in_a_cell_are_held(episode):
    states, fates = episode.log["truth_part_states"], episode.log["truth_fates"]
    last = len(states.data) - 1
    moving = np.abs(states.data.reshape(last + 1, -1, 13)[:, :, 7:]).max(axis=2)
    assert moving[last // 2][fates.data[last // 2] == PartFate.UPSTREAM].min() == 0.0
    assert (moving[fates.data[: last + 1] == PartFate.PLACED] == 0.0).mean() > 0.2


def test_vision_is_late_by_its_lag(episode):
    """What the host reads of a part is where that part was one lag before, up to the measured error."""
    tracks, states = episode.log["parts"], episode.log["truth_part_states"]
    row = np.flatnonzero((tracks["stamp"] > 2.0) & (tracks["number0"] > 0))[0]
    stamp = PartTracks(tracks.data[row]).stamp
    cycles = episode.scenario.vision.lag_cycles + 1  # a sample is the value before the updates at its time
    assert tracks.times[row] - stamp == pytest.approx(cycles / 60.0, abs=1e-9)
    for number, _, _, y in message_rows(tracks.data[row], PART_FIELDS)[:, :4]:
        if number:
            assert y == pytest.approx(np.interp(stamp, states.times, states[f"y_{int(number) - 1}"]), abs=0.01)


def test_the_run_directory_holds_exactly_these_files(episode):
    left = {path.name for path in episode.out.iterdir()}
    assert left == {"summary.json", "log.npz", "scenario.yaml", "recording.html", "conveyor.png"}
    assert json.loads((episode.out / "summary.json").read_text())["placed"] == episode.summary["placed"]


def test_a_replay_of_the_parts_is_bit_identical(episode, tmp_path):
    recording = open_recording(episode.out)
    assert recording.start == "points" and recording.sources == ("parts", "diagnosis", "status")
    result = replay_run(recording, tmp_path)
    assert set(result["signals"]) == {"prediction", "delivered", "packet_report", "target", "belt", "order"}
    assert result["identical"], result["signals"]
    assert result["recorded"]["prediction_0.75_s_rms_m"] < 0.02 and (tmp_path / "replay.png").is_file()


def test_a_run_with_an_encoder_that_stops_goes_on_with_vision_and_is_replayed_bit_by_bit(tmp_path):
    overrides = ["arrivals.rate=20", "belt.encoder=true", "faults=[!EncoderStopped {at: 2.5}]"]
    run = Episode(tmp_path / "run", duration=5.0, overrides=overrides, record=False)
    assert run.summary["encoder_unused_s"] == pytest.approx(2.1, abs=0.2) and run.summary["picked"] >= 1
    recording = open_recording(run.out)
    assert recording.sources == ("parts", "diagnosis", "status", "encoder")
    result = replay_run(recording)
    assert "encoder_report" in result["signals"] and result["identical"], result["signals"]


def test_parts_on_their_sides_are_left_alone(tmp_path):
    run = Episode(tmp_path / "run", duration=6.0, overrides=["arrivals.rate=20", "arrivals.lying=0.9"], record=False)
    lying = [k for k, part in enumerate(resolve(run.scenario).arrivals) if part.lies]
    fates = run.log["truth_fates"].data[:, lying]
    assert len(lying) >= 2 and not np.isin(fates, [PartFate.HELD, PartFate.DROPPED]).any()
    assert not (run.summary["belt_touched"] or run.summary["dropped"])


def test_measured_vision_errs_as_its_settings_say(episode):
    errors, settings = vision_errors(episode.log, resolve(episode.scenario).arrivals), episode.scenario.vision
    assert errors["noise_m"] == pytest.approx(settings.noise_std, rel=0.2)
    assert errors["turn_noise_rad"] == pytest.approx(np.deg2rad(settings.turn_noise_std_deg), rel=0.2)
    assert errors["wrong_kind"] == errors["identities_lost"] == 0 and errors["measurements"] > 300


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """The same loop with cameras, up to the first pick."""
    overrides = ["arrivals.rate=12", "belt.speed=0.15"]
    return Episode(tmp_path_factory.mktemp("seen") / "run", "conveyor", 3.7, overrides, images=True)


def test_with_cameras_a_part_is_picked(seen):
    assert seen.summary["picked"] == 1 and not seen.summary["belt_touched"]
    assert list(seen.summary["lag_s"].values()) == pytest.approx([15.0 / 60.0 + 0.25 / 300.0] * 2, abs=1e-5)


def test_cameras_measure_parts_to_a_millimetre_and_keep_their_kinds_and_numbers(seen):
    arrivals = resolve(seen.scenario).arrivals
    errors = vision_errors(seen.log, arrivals)
    assert errors["parts"] >= 1 and errors["wrong_kind"] == errors["identities_lost"] == 0
    assert errors["bias_m"] < 0.001 and errors["noise_m"] < 0.001 and errors["largest_m"] < 0.004
    assert errors["turn_noise_rad"] < np.deg2rad(3.0)


def test_vision_looks_at_every_second_pair_of_images(seen):
    stamps = np.unique(seen.log["parts"]["stamp"])[1:]
    cycles = np.round(60.0 * stamps).astype(int)
    assert seen.scenario.vision.update_cycles == 2 and np.array_equal(cycles, 2 * np.arange(1, len(cycles) + 1))
    pipeline = resolve(load_scenario("conveyor", overrides=["cameras.render_processes='1'"])).pipeline
    assert [pipeline.wanted(cycle) for cycle in range(4)] == [True, False, True, False]


def test_the_run_leaves_a_video_and_the_images(seen):
    left = {path.name for path in seen.out.iterdir()}
    expected = {"summary.json", "log.npz", "scenario.yaml", "recording.html", "conveyor.png", "cameras.mp4"}
    assert left == {*expected, "images"}
    assert set(task_of(seen.scenario).files_of(seen.scenario)) == expected


@pytest.mark.parametrize("start", ["points", "images"])
def test_a_replay_of_the_run_with_cameras_is_bit_identical(seen, start):
    result = replay_run(open_recording(seen.out, start=start))
    assert result["identical"], result["signals"]
    assert ("parts" in result["signals"]) == (start == "images")


def test_there_is_nothing_to_replay_from_centroids(seen):
    with pytest.raises(DrakeTrackerError, match="has no centroids; use --from points"):
        open_recording(seen.out, start="centroids")


def test_a_modern_arm_does_the_same_within_its_limits(tmp_path):
    """Of the subsystems only the description of the arm differs."""
    overrides = ["arm=!UR5e {}", "belt.speed=0.15", "arrivals.rate=60", "arrivals.gap=0.005"]
    scenario = load_scenario("conveyor:measured", seed=11, duration=2.4, overrides=overrides)
    summary = simulate(scenario, out=tmp_path / "run", options=RunOptions(record=False))
    assert summary["picked"] == 1 and summary["dropped"] == summary["set_points_changed"] == 0
    assert not any(summary[f"{what}_touched"] for what in ("belt", "tray", "table", "self"))
    assert summary["joint_limit_margin_rad"] > 0.1 and summary["speed_share"] < 1.0
    log = load_log(tmp_path / "run" / "log.npz")
    assert np.abs(log["arm_effort"].data).max(axis=0) == pytest.approx(0.0, abs=150.0)
    assert np.all(np.abs(log["arm_effort"].data[:, 3:]) <= 28.0)
