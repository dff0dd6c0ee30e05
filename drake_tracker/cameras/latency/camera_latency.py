"""The latency of each camera in a calibration file, which `drake-tracker lag` measures."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.bounded_yaml import load_yaml
from drake_tracker.core.files.regular_file import read_text

LONGEST = 10.0
"""Greatest latency that a file may contain [s]; the slowest network cameras need a few seconds."""
_SHORTEST = -0.1
"""Least latency [s]; below 0 by the errors of measurement only, or because a screen shows an image late."""
_DIGITS = 6


def load_latencies(path: str | Path) -> dict[str, float]:
    """Returns {name: latency [s]} of the cameras in a calibration file for which it was measured.

    Empty for a file of another format, or one that cannot be read: reading the cameras themselves reports that.

    Raises DrakeTrackerError, one line, when a latency is not a number, or out of range.
    """
    latencies = {}
    for name, entry in _cameras(_read(path)).items():
        value = entry.get("latency") if isinstance(entry, dict) else None
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not _SHORTEST <= value <= LONGEST:
            raise DrakeTrackerError(
                f"{path}: cameras.{name}.latency is {value!r}; it must be from {_SHORTEST:g} to {LONGEST:g} s"
            )
        latencies[name] = float(value)
    return latencies


def save_latency(path: str | Path, name: str, seconds: float) -> None:
    """Writes the latency of a camera into a calibration file, and leaves everything else in it as it is.

    Args:
        path: of the file.
        name: of the camera.
        seconds: latency [s].

    Raises DrakeTrackerError when the file has no such camera, the latency is out of range, or it cannot be written.
    """
    if not np.isfinite(seconds) or not _SHORTEST <= seconds <= LONGEST:
        raise DrakeTrackerError(
            f"{path}: a latency of {seconds:.3f} s is not written; it must be from {_SHORTEST:g} to {LONGEST:g} s"
        )
    data = _read(path)
    cameras = _cameras(data)
    if not isinstance(cameras.get(name), dict):
        raise DrakeTrackerError(
            f"{path}: there is no {name} to which to add a latency; found {', '.join(cameras) or 'none'}"
        )
    cameras[name]["latency"] = round(float(seconds), _DIGITS)
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=120)
    write_text(path, "# Camera matrices found from images of a board, and latencies.\n" + text)


def _read(path: str | Path) -> Any:
    try:
        return load_yaml(read_text(path))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return None


def _cameras(data: Any) -> dict[str, Any]:
    cameras = data.get("cameras") if isinstance(data, dict) else None
    return cameras if isinstance(cameras, dict) else {}
