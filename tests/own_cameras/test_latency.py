"""`track` subtracts the latency of each camera from its stamps."""

import json

import cv2
import numpy as np
from films import CAMERAS, film, on_circle, read_track, write_calibration

from drake_tracker import cli
from drake_tracker.cameras.latency.camera_latency import save_latency

START = 1_700_000_000.5
LATENCIES = {"left": 0.021, "right": 0.121}


def shots(folder, side, times):
    """Images named by their stamps, which are late."""
    folder.mkdir()
    for time, image in zip(times, film(side, times)):
        cv2.imwrite(str(folder / f"{START + time + LATENCIES[side]:.6f}.png"), image)
    return folder.name


def test_cameras_with_different_latencies_meet(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_calibration("stereo.yaml")
    times = np.arange(40) / 30.0
    sources = [shots(tmp_path / side, side, times) for side in LATENCIES]

    def track(out):
        cli.main(["track", *sources, "--calibration", "stereo.yaml", "--no-overlay", "--out", out])
        data = read_track(tmp_path / out)
        off = np.column_stack([data[name] for name in "xyz"]) - on_circle(data["stamp"])
        return data, np.linalg.norm(off, axis=1), json.loads((tmp_path / out / "summary.json").read_text())

    _, late, summary = track("late")
    assert summary["latency_s"] == [0.0, 0.0]
    assert np.nanmedian(late) > 0.004  # the right camera shows where the ball was 0.1 s ago
    for side, latency in LATENCIES.items():
        save_latency("stereo.yaml", f"camera_{side}", latency)
    data, off, summary = track("corrected")
    assert data["valid"].sum() > 30 and np.nanmax(off) < 0.002
    assert summary["latency_s"] == [0.021, 0.121]
    assert abs(summary["stamp_zero"] - START) < 1e-5
    assert set(CAMERAS) == {"camera_left", "camera_right"}
