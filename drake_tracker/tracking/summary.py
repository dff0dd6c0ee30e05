"""What came of tracking with one's own cameras, in numbers."""

import numpy as np

from drake_tracker.tasks.train.summary import git_commit, package_versions, tidy
from drake_tracker.tracking.table import HORIZON


def summarize_track(data, period):
    """Returns a dict of numbers about a track; lengths in m, times in s, pixels in px.

    ``results``: images with a valid point (or centroid, of a single camera without calibration), ``described``: of so
    many. ``gap_rms_m``: by how much the two rays pass each other. ``prediction_rms_m``: predictions `HORIZON` ahead
    against the point measured then, interpolated between neighbours. ``extent_m`` or ``extent_px``: size of the box
    that holds the track. ``seen_by_both``: images in which both cameras saw something move.

    Args:
        data: what `TrackTable.data` returns. period: of the images [s].
    """
    valid = data["valid"] > 0
    names = ("x", "y", "z") if "x" in data else ("u", "v")
    summary = {"described": len(valid), "results": int(valid.sum())}
    path = np.column_stack([data[name][valid] for name in names])
    extent = np.ptp(path, axis=0).tolist() if len(path) else None
    if "x" not in data:
        return summary | {"extent_px": extent}
    gap = data["gap"][valid]
    gap = gap[~np.isnan(gap)]
    filtered = np.column_stack([data[f"filtered_{name}"] for name in names])
    steps = np.diff(data["stamp"])
    sides = [column for name, column in data.items() if name.endswith("_u")]
    seen_by_both = int(np.isfinite(sides).all(axis=0).sum()) if len(sides) == 2 else None
    speeds = np.linalg.norm(np.diff(filtered, axis=0), axis=1) / np.where(steps > 0.0, steps, np.nan)
    return summary | {
        "extent_m": extent,
        "seen_by_both": seen_by_both,
        "gap_rms_m": float(np.sqrt(np.mean(gap**2))) if len(gap) else None,
        "median_speed_m_s": float(np.nanmedian(speeds)) if np.isfinite(speeds).any() else None,
        "prediction_rms_m": _prediction_rms(data, path, valid, period),
        "prediction_horizon_s": HORIZON,
    }


def _prediction_rms(data, path, valid, period):
    foreseen = np.column_stack([data[f"predicted_{name}"] for name in ("x", "y", "z")])
    times, stamps = data["stamp"] + HORIZON, data["stamp"][valid]
    if len(stamps) < 2:
        return None
    after = np.clip(np.searchsorted(stamps, times), 1, len(stamps) - 1)
    near = (stamps[after] - stamps[after - 1] < 2.5 * period) & (times <= stamps[-1]) & (times >= stamps[0])
    measured = np.column_stack([np.interp(times, stamps, column) for column in path.T])
    miss = np.linalg.norm(foreseen - measured, axis=1)[near]
    miss = miss[~np.isnan(miss)]
    return float(np.sqrt(np.mean(miss**2))) if len(miss) else None


def describe_run(**facts):
    """Returns facts fit for JSON, with the versions that made them."""
    return tidy(facts | {"package_versions": package_versions(), "git_commit": git_commit()})
