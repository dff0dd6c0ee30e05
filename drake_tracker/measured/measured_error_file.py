"""The YAML file that keeps a `MeasuredError`, lengths in m; readable for people too."""

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_tracker.cameras.files.calibration_file import check_rig
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.bounded_yaml import load_yaml
from drake_tracker.core.files.regular_file import read_text
from drake_tracker.core.frozen_state import read_only
from drake_tracker.measured.measured_error import AXES, MeasuredError

_DIGITS = 7
_GREATEST = 1e6
"""Greatest number in a file; every length, speed and number of cycles is far smaller."""
_parse = lru_cache(maxsize=4)(load_yaml)
"""Every diagram with measured vision reads the same file; parsing it takes more than a second."""
_HEADER = "# Error of the triangulated point in the camera loop, found by drake-tracker measure. Lengths in m.\n"


def save_error(path: str | Path, error: MeasuredError, *, rig: Mapping[str, Any], notes: Mapping[str, Any]) -> None:
    """Writes a `MeasuredError` to a YAML file.

    Args:
        path: of the file.
        error: the error model.
        rig: {setting: value}, the cameras for which it is valid: numbers, texts and lists.
        notes: {name: value}, how it was found: numbers, texts and lists.

    Raises DrakeTrackerError when the file cannot be written.
    """
    data: dict[str, Any] = {"rig": rig, "notes": notes}
    data |= {"pixel": _plain(error.pixel), "seen_from": _plain(error.seen_from), "speeds": []}
    for k, speed in enumerate(error.speeds):
        data["speeds"].append(
            {
                "speed": _plain(speed),
                "missing_share": _plain(error.missing[k, 0]),
                "missing_length": _plain(error.missing[k, 1]),
                "pattern": _plain(error.pattern[k]),
                "bias_straight": {axis: _plain(error.bias[k, 0, :, a]) for a, axis in enumerate(AXES)},
                "bias_per_curvature": {axis: _plain(error.bias[k, 1, :, a]) for a, axis in enumerate(AXES)},
                "jitter_weights": {axis: _plain(error.jitter[k, a]) for a, axis in enumerate(AXES)},
            }
        )
    text = _HEADER + yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=118)
    write_text(path, text)


def load_error(path: str | Path, rig: Mapping[str, Any] | None = None) -> MeasuredError:
    """Returns the `MeasuredError` of a file that `save_error` wrote.

    Args:
        path: of the file.
        rig: {setting: value} that the file must agree with; None accepts any.

    Raises DrakeTrackerError, one line naming the file and the key, when it is missing or not YAML, when a value is
    missing, of another shape, not finite or out of range, and when the rig differs.
    """
    try:
        data = _parse(read_text(path))
    except (OSError, UnicodeDecodeError):
        raise DrakeTrackerError(f"{path}: cannot be read; drake-tracker measure makes such a file") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        raise DrakeTrackerError(f"{path}{f' line {mark.line + 1}' if mark else ''}: this is not YAML") from None
    data = data if isinstance(data, dict) else {}
    if rig is not None:
        check_rig(path, data.get("rig"), rig, "measure")
    entries = data.get("speeds")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise DrakeTrackerError(f"{path}: speeds must be a list of at least one mapping")
    read = [_read_speed(path, f"speeds[{k}]", entry) for k, entry in enumerate(entries)]
    for name in ("bias", "jitter"):
        if len({part[name].shape for part in read}) > 1:
            raise DrakeTrackerError(f"{path}: the {name} must have the same length at every speed")
    speeds = np.array([part["speed"] for part in read])
    if np.any(np.diff(speeds) <= 0.0):
        raise DrakeTrackerError(f"{path}: speeds must increase from entry to entry")
    bias, pattern, jitter, missing = (
        read_only(np.array([part[name] for part in read])) for name in ("bias", "pattern", "jitter", "missing")
    )
    pixel, seen_from = _numbers(path, "", data, "pixel", None, low=1e-5), _numbers(path, "", data, "seen_from", None)
    return MeasuredError(speeds, bias, pattern, jitter, missing, float(pixel), float(seen_from))


def _read_speed(path: str | Path, where: str, entry: Mapping[str, Any]) -> dict[str, np.ndarray]:
    part = {name: _numbers(path, where, entry, name, None) for name in ("speed", "missing_share", "missing_length")}
    share, length = part.pop("missing_share"), part.pop("missing_length")
    if share > 1.0 or length < 1.0:
        raise DrakeTrackerError(f"{path}: {where}: missing_share must be at most 1, missing_length at least 1")
    part["missing"] = np.array([share, length])
    part["pattern"] = _numbers(path, where, entry, "pattern", 3)
    tables = [_axes(path, where, entry, name) for name in ("bias_straight", "bias_per_curvature")]
    if tables[0].shape != tables[1].shape:
        raise DrakeTrackerError(f"{path}: {where}: both tables of the bias must have the same length")
    part["bias"] = np.stack([table.T for table in tables])
    part["jitter"] = _axes(path, where, entry, "jitter_weights")
    if part["jitter"].shape[1] % 2 == 0:
        raise DrakeTrackerError(f"{path}: {where}.jitter_weights must have an odd number of weights")
    return part


def _axes(path: str | Path, where: str, entry: Mapping[str, Any], name: str) -> np.ndarray:
    """Returns the lists of the three axes, shape (3, n)."""
    table = entry.get(name)
    if not isinstance(table, dict):
        raise DrakeTrackerError(f"{path}: {where}.{name} must be a mapping with {', '.join(AXES)}")
    rows = [_numbers(path, f"{where}.{name}", table, axis, 0, low=-math.inf) for axis in AXES]
    if len({len(row) for row in rows}) > 1:
        raise DrakeTrackerError(f"{path}: {where}.{name} must have lists of one length")
    return np.array(rows)


def _numbers(
    path: str | Path, where: str, entry: Mapping[str, Any], name: str, count: int | None, low: float = 0.0
) -> np.ndarray:
    """Returns a number (``count`` None), a list of ``count`` numbers, or a list of at least one (``count`` 0)."""
    key = f"{where}.{name}" if where else name
    try:
        value = np.array(entry.get(name), dtype=float)
    except (TypeError, ValueError, OverflowError):
        value = np.empty(0)
    shaped = value.ndim == (0 if count is None else 1) and value.size and (not count or value.size == count)
    if not shaped or not np.all(np.abs(value) <= _GREATEST) or np.any(value < low):
        what = {None: "a finite number", 0: "a list of finite numbers"}.get(count, f"{count} finite numbers")
        raise DrakeTrackerError(f"{path}: {key} must be {what}{'' if low == -math.inf else f' from {low:g}'}")
    return value


def _plain(value: Any) -> Any:
    return np.round(value, _DIGITS).tolist()
