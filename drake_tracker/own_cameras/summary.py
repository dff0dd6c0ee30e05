"""The summary of a track of your own cameras."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.footage.timeline import Timeline
from drake_tracker.own_cameras.filtered import count_filtered
from drake_tracker.own_cameras.table import HORIZON, axes_of, split_objects
from drake_tracker.tasks.results import made_by, tidy
from drake_tracker.vision.image_tracks.track_2d import TrackState2D

MOST_DROPPED = 0.2
"""Share of the images of a live camera above which a line says that they were dropped."""
_MOST_NAMED = 1000
"""Largest number of dropped images of a camera whose stamps are listed."""


def summarise_track(data: Mapping[str, np.ndarray], period: float) -> dict[str, Any]:
    """Returns the numbers of a track; lengths in m, times in s, pixels in px.

    Without calibration, the lengths are in px, and the names that end in ``_m`` and ``_m_s`` end in ``_px`` and
    ``_px_s``.

    - ``described``: number of images that the track describes.
    - ``results``: number of those with a valid point (or centroid, for a single camera without calibration).
    - ``states``: number of rows with each state of an object.
    - ``objects_seen``: number of different objects among the rows.
    - ``gap_rms_m``: root mean square of the gap between the two rays; only with calibration.
    - ``prediction_rms_m``: root mean square error of the predictions `HORIZON` ahead, against the points measured at
      that time (interpolated between neighbours).
    - ``extent_m``: size of the bounding box of the track.
    - ``seen``: number of images in which every camera saw motion; only with calibration.
    - ``off_plane``: number of rows in which a single camera saw an object, but not the plane there; only with a plane.
    - ``median_speed_m_s``: median speed of the filtered point.
    - ``filtered``: how many points were filtered, and why the others were not, see `count_filtered`.
    - ``by_object``: the same of each of several objects, with ``id``, number of ``points``, number of rows in which it
      was ``hidden``, and stamps of its first and last row, ``from_s`` and ``to_s``.

    Args:
        data: columns of the track, see `TrackTable.data`.
        period: period of the images [s].
    """
    valid = data["valid"] > 0
    names, unit = axes_of(data)
    images = np.unique(data["stamp"])
    with_result = np.unique(data["stamp"][valid])
    summary: dict[str, Any] = {"described": len(images), "results": len(with_result)}
    if "state" in data:
        summary["states"] = {
            state.name.lower(): int((data["state"] == state).sum())
            for state in TrackState2D
            if (data["state"] == state).any()
        }
        numbers = data["id"][np.isfinite(data["id"])]
        summary["objects_seen"] = len(np.unique(numbers))
    path = np.column_stack([data[name][valid] for name in names])
    extent = np.ptp(path, axis=0).tolist() if len(path) else None
    summary[f"extent_{unit}"] = extent
    if unit == "m":
        sides = [data[name] for name in ("left_u", "right_u") if name in data]
        seen = np.isfinite(sides).all(axis=0)
        summary["seen"] = len(np.unique(data["stamp"][seen]))
        if len(sides) == 1:
            summary["off_plane"] = int((seen & ~valid).sum())
    parts = split_objects(data)
    summary |= {**_accuracy(list(parts.values()), period), "prediction_horizon_s": HORIZON}
    if list(parts) != [0]:
        summary["by_object"] = [_describe(number, part, period) for number, part in parts.items() if number]
    return summary


def _describe(number: int, part: Mapping[str, np.ndarray], period: float) -> dict[str, Any]:
    """Returns the numbers of one of several objects."""
    return {
        "id": number,
        "points": int((part["valid"] > 0).sum()),
        "hidden": int((part["state"] == TrackState2D.HIDDEN).sum()),
        "from_s": float(part["stamp"][0]),
        "to_s": float(part["stamp"][-1]),
        **_accuracy([part], period),
    }


def _accuracy(parts: Sequence[Mapping[str, np.ndarray]], period: float) -> dict[str, Any]:
    """Returns gap, speed, predictions and filtered points of the rows of one object or several."""
    gaps, speeds, errors = [], [], []
    filtered: Counter[str] = Counter()
    names, unit = axes_of(parts[0])
    for part in parts:
        valid = part["valid"] > 0
        gap = part.get("gap", np.full(len(valid), np.nan))[valid]
        gaps.append(gap[~np.isnan(gap)])
        places = np.column_stack([part[f"filtered_{name}"] for name in names])
        steps = np.diff(part["stamp"])
        speeds.append(np.linalg.norm(np.diff(places, axis=0), axis=1) / np.where(steps > 0.0, steps, np.nan))
        errors.append(_prediction_errors(part, valid, period))
        filtered.update(count_filtered(part))
    gap, speed, error = (np.concatenate(each) for each in (gaps, speeds, errors))
    gap_rms = {"gap_rms_m": float(np.sqrt(np.mean(gap**2))) if len(gap) else None} if unit == "m" else {}
    return {
        **gap_rms,
        f"median_speed_{unit}_s": float(np.nanmedian(speed)) if np.isfinite(speed).any() else None,
        "filtered": dict(filtered),
        f"prediction_rms_{unit}": float(np.sqrt(np.mean(error**2))) if len(error) else None,
    }


def _prediction_errors(data: Mapping[str, np.ndarray], valid: np.ndarray, period: float) -> np.ndarray:
    """Returns the errors of the predictions that can be judged, in the unit of the track."""
    names, _ = axes_of(data)
    predicted = np.column_stack([data[f"predicted_{name}"] for name in names])
    path = np.column_stack([data[name][valid] for name in names])
    times, stamps = data["stamp"] + HORIZON, data["stamp"][valid]
    if len(stamps) < 2:
        return np.zeros(0)
    after = np.clip(np.searchsorted(stamps, times), 1, len(stamps) - 1)
    near = (stamps[after] - stamps[after - 1] < 2.5 * period) & (times <= stamps[-1]) & (times >= stamps[0])
    measured = np.column_stack([np.interp(times, stamps, column) for column in path.T])
    error = np.linalg.norm(predicted - measured, axis=1)[near]
    return error[~np.isnan(error)]


def describe_footage(timeline: Timeline, dropped: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Returns the faults of the images of each camera.

    - ``dropped``: number of ticks of the clock without an image, and ``dropped_at_s``: their stamps, at most 1000.
    - ``surplus``: number of images that came too early for a tick of their own.
    - ``warnings``: one line for each source with images that could not be read.

    Args:
        timeline: of the cameras.
        dropped: stamps of the ticks without an image [s], for each camera.
    """
    warnings = [each.footage.warning() for each in timeline.sequences]
    return {
        "dropped": [len(stamps) for stamps in dropped],
        "dropped_at_s": [list(stamps[:_MOST_NAMED]) for stamps in dropped],
        "surplus": [each.surplus for each in timeline.sequences],
        "warnings": [*timeline.notes, *(line for line in warnings if line is not None)],
    }


def describe_delay(
    dropped: Sequence[Sequence[float]], described: int, size: tuple[int, int], period: float
) -> str | None:
    """Returns one line when the computer was too slow for its live cameras, else None.

    Args:
        dropped: stamps of the ticks without an image [s], for each camera.
        described: number of images described.
        size: (width, height) of the images [px].
        period: of the images [s].
    """
    missing = max(map(len, dropped))
    if missing <= MOST_DROPPED * described:
        return None
    return (
        f"{missing} of {max(described, missing)} images of a camera were dropped, and motion is seen only where "
        f"several follow each other: this computer is busy, or too slow for {size[0]} x {size[1]} px at "
        f"{1.0 / period:.3g} images/s; smaller images, fewer of them (--fps) or --no-overlay help"
    )


def describe_run(**facts: Any) -> dict[str, Any]:
    """Returns facts as values for JSON, with the versions of the software that produced them."""
    return tidy(facts | made_by())
