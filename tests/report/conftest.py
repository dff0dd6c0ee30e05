"""The directory of a synthetic run."""

import json

import pytest
from autopsy_run import AutopsyRun

from drake_tracker.core.log import save_log
from drake_tracker.tasks import save_scenario
from drake_tracker.tasks.results import package_versions, tidy


@pytest.fixture(scope="session")
def made_up():
    """(scenario, log) of a run in which the hand goes down beside the train."""
    run = AutopsyRun(beside=0.04)
    return run.scenario(), run.log()


@pytest.fixture
def run_folder(made_up, tmp_path):
    scenario, log = made_up
    folder = tmp_path / "run"
    folder.mkdir()
    save_scenario(scenario, folder / "scenario.yaml")
    save_log(log, folder / "log.npz")
    summary = {
        "scenario": "made-up <1>",
        "seed": 1,
        "success": False,
        "failure_reason": "attempt 1 missed",
        "attempts": 1,
        "prediction_rms_m": 0.0123,
        "lag_s": {"min": 0.25, "max": 0.25},
        "package_versions": package_versions(),
    }
    (folder / "summary.json").write_text(json.dumps(tidy(summary)))
    (folder / "recording.html").write_text("<p>recording</p>")
    (folder / "cameras.mp4").write_bytes(bytes(range(256)) * 4)
    for name in ("tracking.png", "motion.png"):
        (folder / name).write_bytes(b"picture")
    return folder
