"""A complete run of the default scenario with rendered images, from the first image to the lifted train."""

import base64
import json
import re

import cv2
import numpy as np
import pytest

from drake_tracker import load_scenario, simulate
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.plant import actuators_of
from drake_tracker.core.log import load_log
from drake_tracker.core.timing import ESTIMATOR_SLOT, TIME_STEP
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.network.channels import FROM_TRACKER
from drake_tracker.run.camera_video import FRAMES_PER_SECOND
from drake_tracker.tasks.train.task import TASK

SEED = 0
PROMISED = {
    *("scenario", "seed", "success", "failure_reason", "attempts", "first_attempt_success", "time_to_grasp_s"),
    *("lift_height_m", "hold_s", "prediction_rms_m", "prediction_p95_m", "vision_valid_fraction"),
    *("triangulation_rms_m", "closing_onset_error_s", "real_time_factor", "wall_time_s", "package_versions"),
    "git_commit",
}


class Episode:
    def __init__(self, out):
        self.out = out
        self.scenario = load_scenario("train", seed=SEED)
        self.progress = []
        self.summary = simulate(
            self.scenario, out=out, progress=lambda time, phase: self.progress.append((time, phase))
        )
        self.log = load_log(out / "log.npz")


@pytest.fixture(scope="module")
def episode(tmp_path_factory):
    return Episode(tmp_path_factory.mktemp("episode") / "run")


def test_the_train_is_lifted_off_its_track(episode):
    summary = episode.summary
    assert summary["success"], summary["failure_reason"]
    assert summary["failure_reason"] is None
    assert summary["attempts"] == 1 and summary["first_attempt_success"]
    assert summary["lift_height_m"] >= 0.10 and summary["hold_s"] >= 1.0
    assert 5.0 < summary["time_to_grasp_s"] < 60.0
    assert summary["simulated_s"] < 60.0, "a run ends once the train was taken"


def test_the_phases_are_in_order(episode):
    phases = episode.log["command"]["phase"]
    seen = [Phase(int(phases[0]))] + [Phase(int(b)) for a, b in zip(phases, phases[1:]) if a != b]
    assert seen == [Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE, Phase.LIFT, Phase.HOLD]
    named = [activity.partition(":")[0] for _, activity in episode.progress]
    assert list(dict.fromkeys(named)) == [phase.name.lower() for phase in seen]
    times = [time for time, _ in episode.progress]
    assert times == sorted(times) and times[-1] == pytest.approx(episode.summary["simulated_s"], abs=0.05)


def test_the_errors_of_all_parts_are_small(episode):
    summary = episode.summary
    assert summary["vision_valid_fraction"] > 0.95
    assert summary["triangulation_rms_m"] < 0.010
    assert summary["triangulation_jitter_m"] < 0.003
    assert summary["prediction_rms_m"] < 0.015
    assert summary["prediction_rms_m"] <= summary["prediction_p95_m"] < 0.030
    lag = 0.250 + ESTIMATOR_SLOT * TIME_STEP
    assert summary["lag_s"]["min"] == pytest.approx(lag, abs=2e-6) == summary["lag_s"]["max"]


def test_the_arm_kept_within_its_limits_at_every_step_of_the_plant(episode):
    state, effort = episode.log["arm_state"], episode.log["arm_effort"]
    assert np.diff(state.times) == pytest.approx(TIME_STEP, abs=1e-9)
    assert len(state.times) >= episode.summary["simulated_s"] / TIME_STEP
    model = make_arm_model(PUMA560)
    q, v = np.split(state.data, 2, axis=1)
    assert np.all(q > model.position_lower) and np.all(q < model.position_upper)
    assert np.all(np.abs(v) <= model.velocity_limit), np.max(np.abs(v) / model.velocity_limit, axis=0)
    limits = np.array([actuator.effort_limit() for actuator in actuators_of(model.plant, model.arm_instance)])
    saturated = np.abs(effort.data) >= 0.999 * limits
    longer = int(0.030 / TIME_STEP) + 1  # samples in a row
    for drive in saturated.T:
        assert np.convolve(drive, np.ones(longer), "valid").max() < longer
    assert not episode.summary["table_touched"]
    assert not np.any(episode.log["truth_verdict"]["table_touched"])


def test_the_returned_summary_is_the_written_one(episode):
    assert set(episode.summary) >= PROMISED
    written = json.loads((episode.out / "summary.json").read_text())
    assert set(written) == set(episode.summary)
    for key in PROMISED - {"real_time_factor", "wall_time_s"}:
        assert written[key] == episode.summary[key], key
    assert (written["scenario"], written["seed"]) == ("train", SEED)
    assert written["real_time_factor"] > 0.0 and all(seconds > 0.0 for seconds in written["wall_time_s"].values())
    assert written["package_versions"]["drake"] and written["package_versions"]["python"]


def test_the_log_holds_all_signals_with_their_names(episode):
    not_here = {*FROM_TRACKER, "truth_judged", "hand_point", "hand_correction", "wrist"}
    signals = {name: each for name, each in TASK.signals().items() if name not in not_here}
    assert set(signals) <= set(episode.log) and not not_here & set(episode.log)
    for name, (period, fields) in signals.items():
        signal = episode.log[name]
        assert signal.names == tuple(fields)
        assert signal.data.shape == (len(signal.times), len(fields))
        assert np.isfinite(signal.data).all(), name
        assert np.diff(signal.times) == pytest.approx(period, abs=1e-9), name
        assert signal.times[-1] == pytest.approx(episode.summary["simulated_s"], abs=2 * period)


def test_the_video_has_thirty_frames_per_second(episode):
    video = cv2.VideoCapture(str(episode.out / "cameras.mp4"))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(FRAMES_PER_SECOND)
    count, brightness = 0, []
    while True:
        more, frame = video.read()
        if not more:
            break
        count += 1
        brightness.append(frame.mean())
    assert count == int(episode.summary["simulated_s"] * FRAMES_PER_SECOND + 1e-3) + 1  # the summary is rounded
    assert min(brightness) > 5.0
    width, height = (int(video.get(key)) for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    assert width >= 2 * 256 and height >= 256


def test_the_recording_is_self_contained(episode):
    page = (episode.out / "recording.html").read_text()
    assert len(page) > 100_000
    assert not re.search(r"""<(script|link|img)[^>]+(src|href)=["']?(https?:)?//""", page)
    scene = b"".join(base64.b64decode(chunk) for chunk in re.findall(r"base64,([A-Za-z0-9+/]+=*)", page))
    assert b"laboratory/puma560" in scene and b"laboratory/train" in scene
    assert b"set_animation" in scene


def test_the_picture_can_be_read(episode):
    picture = cv2.imread(str(episode.out / "tracking.png"))
    assert min(picture.shape[:2]) >= 600
    assert len(np.unique(picture[::4, ::4].astype(int) @ [1, 256, 65536])) > 50


def test_the_saved_scenario_gives_the_same_run(episode):
    again = load_scenario(str(episode.out / "scenario.yaml"))
    assert again == episode.scenario


def test_the_run_directory_holds_exactly_these_files(episode):
    left = {path.name for path in episode.out.iterdir()}
    pictures = {"recording.html", "cameras.mp4", "tracking.png", "motion.png", "grasp.png"}
    assert left == {"summary.json", "log.npz", "scenario.yaml"} | pictures


def test_the_same_seed_gives_the_same_summary():
    runs = []
    for _ in range(2):
        summary = simulate(load_scenario("train", seed=5, duration=1.5))
        del summary["real_time_factor"], summary["wall_time_s"]
        runs.append(summary)
    assert runs[0] == runs[1]
    assert runs[0]["simulated_s"] == pytest.approx(1.5) and runs[0]["success"] is False
