"""The page of a run whose scenario names code: nothing of it is imported or called, whatever the user trusts."""

import sys

import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.parts import check_custom_parts
from drake_tracker.report.page import page_of
from drake_tracker.report.run_files import read_run
from drake_tracker.scenarios.base import Custom
from drake_tracker.scenarios.consent import TRUSTED_FOLDERS
from drake_tracker.tasks import save_scenario


def test_a_run_whose_track_cannot_be_placed_is_shown_without_autopsy(run_folder, made_up):
    csv = run_folder / "track.csv"
    csv.write_text("x,y\n0.5,0\n0.6,0\n")
    track = {"track.kind": "csv", "track.csv": str(csv), "estimator": Custom("viewed_code.Estimator")}
    save_scenario(made_up[0].with_settings(track), run_folder / "scenario.yaml")
    run = read_run(run_folder)
    page_of(run)
    (note,) = [note for note in run.notes if "autopsy" in note]
    assert note.startswith("There is no autopsy: track file") and "has 2 points" in note


def test_viewing_a_run_imports_nothing_that_its_scenario_names(run_folder, made_up, tmp_path, monkeypatch):
    monkeypatch.setenv(TRUSTED_FOLDERS, str(tmp_path))
    monkeypatch.setattr(sys, "path", list(sys.path))
    (run_folder / "viewed_code.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    parts = {"estimator": Custom("viewed_code.Estimator"), "arm": Custom("viewed_code.arm")}
    save_scenario(made_up[0].with_settings(parts), run_folder / "scenario.yaml")
    run = read_run(run_folder)
    assert run.scenario.estimator.folder == str(run_folder) and not any("cannot be read" in note for note in run.notes)
    assert "<h2>Phases" in page_of(run)
    assert any("it needs the arm viewed_code.arm, and viewing runs no code" in note for note in run.notes)
    with pytest.raises(DrakeTrackerError, match="the file names code to run"):
        check_custom_parts(run.scenario)
    assert not (tmp_path / "ran").exists() and "viewed_code" not in sys.modules and str(run_folder) not in sys.path
