"""A run whose vision tracks several objects, from the log to the page, with measured vision: nothing is rendered."""

import cv2
import numpy as np
import pytest

from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import TRACK_FIELDS, TrackPoints, message_rows
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.replay.recording import open_recording
from drake_tracker.replay.replay import replay_run
from drake_tracker.report import page_of, read_run
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.task import TASK
from drake_tracker.vision.region_of_interest import footprint
from drake_tracker.world.config import TRAIN_SIZE
from drake_tracker.world.imaging.image_pipeline import MOST_LATENCY

SEVERAL = "vision.method=!SilhouetteTracker {}"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of two trains, long enough for predictions."""
    folder = tmp_path_factory.mktemp("two") / "run"
    scenario = load_scenario("train:two", seed=1, duration=2.5, overrides=["vision=!Measured {}"])
    simulate(scenario, folder, RunOptions(record=False))
    return folder


def test_the_log_has_the_tracks_of_both_trains(run):
    log = load_log(run / "log.npz")
    assert not {"centroid_left", "regions_left"} & log.keys()
    assert not log["truth_judged"].data.any(), "the first train, since nothing was touched"
    tracks = log["tracks"]
    assert tracks.names == tuple(TrackPoints.get_fields())
    last = tracks.data[-1]
    assert message_rows(last, TRACK_FIELDS)[:, 0].tolist() == [1.0, 2.0] + [0.0] * 6
    assert tracks.times[-1] - tracks["stamp"][-1] == pytest.approx(16 * VISION_PERIOD)  # before the update
    for row, name in zip(message_rows(last, TRACK_FIELDS), ("truth_train_state", "truth_object_states")):
        truth = log[name]
        at = round(tracks["stamp"][-1] / VISION_PERIOD)
        x, y = (
            truth.data[at, truth.names.index(axis)] for axis in (("x", "y") if "x" in truth.names else ("x_0", "y_0"))
        )
        assert row[2:4] == pytest.approx([x, y], abs=0.01)


def test_a_replay_of_the_tracks_is_bit_identical(run):
    recording = open_recording(run)
    assert recording.start == "points" and recording.sources == ("tracks",)
    result = replay_run(recording)
    assert set(result["signals"]) == {"filtered", "prediction", "delivered", "packet_report", "target"}
    assert result["identical"], result["signals"]
    assert recording.log["delivered"]["seq"][-1] > 5


def test_the_page_misses_no_file_that_such_a_run_does_not_leave(run):
    found = read_run(run)
    assert not any("motion.png" in note or "cameras.mp4" in note for note in found.notes)
    text = page_of(found)
    assert "not lifted" in text and "Traceback" not in text
    rendered = load_scenario("train:two")
    assert "cameras.mp4" in TASK.files_of(rendered) and "motion.png" not in TASK.files_of(rendered)
    assert "motion.png" in TASK.files_of(load_scenario("train:learned"))


def test_the_settings_of_the_run_are_read_again(run):
    assert isinstance(load_scenario(str(run / "scenario.yaml")).vision.method, SeveralObjects)


@pytest.mark.parametrize(
    "overrides, latency",
    [
        ([SEVERAL], MOST_LATENCY),
        ([SEVERAL, "vision.lag_cycles=5"], 4),
        (["vision.lag_cycles=5"], 2),
        ([SEVERAL, "vision.lag_cycles=1"], None),
    ],
)
def test_the_newest_image_of_several_objects_may_be_one_cycle_old(overrides, latency):
    pipeline = resolve(load_scenario("train:learned", overrides=["cameras.render_processes=1", *overrides])).pipeline
    assert (None if pipeline is None else pipeline.latency) == latency


def test_only_the_images_that_vision_looks_at_are_rendered_beforehand():
    for name, every in (("train", 1), ("train:guided", 1), ("train:guided", 2), ("train:wrist", 3)):
        cycles = [f"vision.method.update_cycles={every}"] if name != "train" else []
        setup = resolve(load_scenario(name, overrides=["cameras.render_processes=1", *cycles]))
        assert setup.update_cycles == every
        assert [setup.pipeline.wanted(cycle) for cycle in range(6)] == [cycle % every == 0 for cycle in range(6)]


def test_a_slow_train_is_refused_by_the_motion_detector_only():
    slow = ["track.speed=0.01", "cameras.render_processes=0"]
    assert resolve(load_scenario("train:learned", overrides=[*slow, SEVERAL])).pipeline is None
    TASK.build(load_scenario("train:learned", overrides=[*slow, SEVERAL]), None)
    with pytest.raises(DrakeTrackerError, match="the threshold needs at least"):
        TASK.build(load_scenario("train:learned", overrides=slow), None)


@pytest.mark.parametrize("scenario", ["train:guided", "train:visitor"])
def test_an_object_at_the_border_of_the_work_volume_shows_whole(scenario):
    """The window once ended where the volume ends: it cut trains, so that two trains 0.15 m apart were one."""
    tracker = resolve(load_scenario(scenario))
    alone = resolve(load_scenario(scenario, overrides=["vision.method=!MotionCentroid {}"]))
    vision = tracker.scenario.vision
    rim = footprint(vision.work_volume, vision.outline)
    middle = np.mean(vision.work_volume, axis=0)
    outwards = (rim - middle[:2]) / np.hypot(*(rim - middle[:2]).T)[:, None]
    edge = np.column_stack([rim + 0.5 * TRAIN_SIZE[1] * outwards, np.full(len(rim), middle[2])])
    for side in SIDES:
        inside = [
            [
                cv2.pointPolygonTest(setup.search_windows[side].polygon.astype(np.float32), place, False) >= 0.0
                for place in setup.cameras[side].project(edge).tolist()
            ]
            for setup in (tracker, alone)
        ]
        assert all(inside[0]) and not all(inside[1])
