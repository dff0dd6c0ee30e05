"""The common part of the summaries of all tasks: writing as JSON, package versions, the commit, and the lag."""

import json
import math
import platform
import subprocess
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.arm.safety.joint_limiter import Limit
from drake_tracker.arm.safety.packet_guard import describe_rejections
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import read_regular
from drake_tracker.core.log import Signal
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.tasks.episode import fresh_packets

_PACKAGES = ("drake_tracker", "drake", "numpy", "scipy", "opencv-python-headless", "matplotlib")
_DECIMALS = 6
_MOST = 1 << 24
"""Largest size of a summary [bytes]."""


def save_summary(summary: Mapping[str, Any], path: Path) -> None:
    """Writes a summary as JSON. Numbers that are not finite become null.

    Args:
        summary: the summary of a run.
        path: file to write, ``*.json``.
    """
    write_text(path, json.dumps(tidy(summary), indent=2) + "\n")


def load_summary(path: Path) -> dict[str, Any]:
    """Returns a summary that `save_summary` wrote. Raises DrakeTrackerError when it cannot be read or is damaged."""
    try:
        summary = json.loads(read_regular(path, _MOST))
    except OSError as error:
        raise DrakeTrackerError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else error
        raise DrakeTrackerError(f"{path}: this is not JSON: {reason}") from None
    if not isinstance(summary, dict):
        raise DrakeTrackerError(f"{path}: this summary is not a mapping")
    return summary


def tidy(value: Any) -> Any:
    """Returns a value that JSON can represent, with all values in it.

    NumPy scalars become Python numbers. Numbers are rounded to six decimals (micrometres, microseconds); NaN and
    infinity become None.
    """
    if isinstance(value, dict):
        return {key: tidy(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [tidy(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return round(float(value), _DECIMALS) if math.isfinite(value) else None
    return value


def package_versions() -> dict[str, str | None]:
    """Returns {name: version} of Python and of the packages on which results depend, None for a missing package."""
    versions: dict[str, str | None] = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = None
    return versions


def git_commit() -> str | None:
    """Returns the git commit of the checkout that contains this package, or None when it is not in a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    try:
        run = subprocess.run(["git", "-C", str(root), "rev-parse", "HEAD"], capture_output=True, text=True, timeout=5)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return run.stdout.strip() if run.returncode == 0 else None


def made_by() -> dict[str, Any]:
    """Returns ``package_versions`` and ``git_commit`` of the code that makes a result."""
    return {"package_versions": package_versions(), "git_commit": git_commit()}


def last_message(signal: Signal, view: Any) -> Any:
    """Returns the last message of a signal, all zeros when there is none.

    Args:
        signal: of the log.
        view: named view of the message.
    """
    return view(signal.data[-1] if len(signal.data) else np.zeros(len(view.get_fields())))


def packet_findings(log: Mapping[str, Signal]) -> dict[str, Any]:
    """Returns the number of packets that the arm's receiver rejected in a run, and {reason: number of packets}.

    Both are None for a run of an earlier version, which did not log them.

    Args:
        log: {name: Signal} of the run.
    """
    report = log.get("packet_report")
    if report is None or not len(report.times):
        return {"packets_rejected": None, "packets_rejected_for": None}
    return {
        "packets_rejected": int(report["rejected"][-1]),
        "packets_rejected_for": describe_rejections(report.data[-1]),
    }


def limiter_findings(log: Mapping[str, Signal]) -> dict[str, Any]:
    """Returns how many set-points the limiter of the joints changed in a run, and {limit: number of set-points}.

    Both are None for a run of an earlier version, which had no limiter.

    Args:
        log: {name: Signal} of the run.
    """
    report = log.get("limiter_report")
    if report is None or not len(report.times):
        return {"set_points_changed": None, "set_points_changed_for": None}
    counts = {limit.name.lower(): int(report[limit.name.lower()][-1]) for limit in Limit}
    return {
        "set_points_changed": int(report["changed"][-1]),
        "set_points_changed_for": {name: count for name, count in counts.items() if count},
    }


def lag_of(log: Mapping[str, Signal], time_step: float) -> dict[str, float] | None:
    """Returns the smallest and the greatest lag of a run, {"min", "max"} [s], or None without a packet.

    The lag is the time from the stamp of a point to the instant at which the estimator outputs the packet based on it.
    The stamp is the capture time of the image that the point describes: the middle one of three for normal flow, or the
    instant midway between two. The newest image used is younger by the detector's ``stamp_age_cycles``. A packet
    appears in the log one cycle after the slot in which the estimator made it.

    Args:
        log: {name: Signal} of the run.
        time_step: the plant's step [s].
    """
    prediction = log["prediction"]
    index = fresh_packets(prediction)
    made = prediction.times[index] - VISION_PERIOD + vision_slot(ESTIMATOR_SLOT, time_step)
    lag = made - prediction["stamp"][index]
    return {"min": lag.min(), "max": lag.max()} if len(lag) else None
