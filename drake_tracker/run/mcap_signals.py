"""The signals of a log as messages of an MCAP file."""

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum

import numpy as np

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.core.files.mcap_file import McapFile
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import Prediction, TrackPoint, prediction_knots
from drake_tracker.core.timing import TIME_STEP, VISION_PERIOD

_JOINTS = ("arm_state", "arm_effort")
"""Signals that become ``foxglove.JointStates``."""
_EVERY = 2 * VISION_PERIOD
"""Least time between two states of the arm in the file [s]; the log has them in each step of the plant."""
_MOST_NUMBERS = 40
"""Fields of the longest signal that is written number by number: more than these nobody plots."""
_POSITION = ("x", "y", "z")
_TURN = ("qw", "qx", "qy", "qz")


def write_signals(file: McapFile, log: Mapping[str, Signal], phases: type[IntEnum], model: ArmModel) -> None:
    """Writes a log: joints, frames of the arm, points, poses, predicted paths, phases, and numbers for plots.

    Signals that 3-D views can show go to ``/NAME``. Every signal of up to 40 fields, except those of the joints, also
    goes to ``/signals/NAME``, number by number. Points and paths appear at the time at which their port shows them;
    their stamp is among the numbers.

    Args:
        file: file to write to.
        log: {name: Signal} of a run.
        phases: enumeration of the phases in `ArmCommand`.
        model: the controller's model of the arm.
    """
    for name, signal in log.items():
        previous: np.ndarray | None = None
        for time, row in zip(signal.times.tolist(), signal.data):
            seen = previous is not None and np.array_equal(row, previous)
            write_sample(file, name, time, signal.names, row, shown=not seen, plotted=name not in _JOINTS)
            previous = row
    if "command" in log:
        _write_phases(file, log["command"], phases)
    if "arm_state" in log:
        _write_arm(file, log["arm_state"], log.get("arm_effort"), model)


def write_sample(
    file: McapFile,
    name: str,
    time: float,
    names: Sequence[str],
    row: np.ndarray,
    *,
    shown: bool = True,
    plotted: bool = True,
) -> None:
    """Writes one sample of a signal: to ``/NAME`` for 3-D views, and to ``/signals/NAME``, number by number.

    Args:
        file: file to write to.
        name: of the signal.
        time: of the sample [s].
        names: of its fields.
        row: its values.
        shown: whether 3-D views get it, if they can show such a signal.
        plotted: whether its numbers are written, if they are not too many.
    """
    values = dict(zip(names, row.tolist()))
    write = _writer(tuple(names)) if shown else None
    if write is not None:
        write(file, f"/{name}", time, values, row)
    if plotted and len(names) <= _MOST_NUMBERS:
        file.values(f"/signals/{name}", time, values)


def _write_phases(file: McapFile, command: Signal, phases: type[IntEnum]) -> None:
    last = None
    for time, phase in zip(command.times.tolist(), command["phase"].tolist()):
        if phase != last:
            file.note("/phase", time, phases(int(phase)).name)
        last = phase


def _write_arm(file: McapFile, state: Signal, effort: Signal | None, model: ArmModel) -> None:
    stride, n = max(1, round(_EVERY / TIME_STEP)), model.num_joints
    names = model.joint_names
    for k in range(0, len(state.times), stride):
        time, row = float(state.times[k]), state.data[k]
        if not np.isfinite(row).all():
            continue
        torques = effort.data[k, :n] if effort is not None and k < len(effort.data) else None
        file.joints("/joint_states", time, names, row[:n], row[n : 2 * n], torques)
        file.transforms("/tf", time, model.body_poses(row[:n]))


_Write = Callable[[McapFile, str, float, Mapping[str, float], np.ndarray], None]


def _writer(fields: tuple[str, ...]) -> _Write | None:
    """Returns the function that writes a sample of a signal for 3-D views, or None if 3-D views cannot show it."""
    if fields == tuple(Prediction.get_fields()):
        return _write_prediction
    if fields == tuple(TrackPoint.get_fields()):
        return _write_point
    if set(_POSITION) <= set(fields) and ("yaw" in fields or set(_TURN) <= set(fields)):
        return _write_pose
    return None


def _write_prediction(file: McapFile, topic: str, time: float, values: Mapping[str, float], row: np.ndarray) -> None:
    if values["valid"]:
        knots = prediction_knots(row)
        file.path(topic, time, knots[:, :3], knots[:, 3])
        file.points(f"{topic}/points", time, knots[:, :3])


def _write_point(file: McapFile, topic: str, time: float, values: Mapping[str, float], row: np.ndarray) -> None:
    if values["valid"]:
        file.points(topic, time, [[values[name] for name in _POSITION]])


def _write_pose(file: McapFile, topic: str, time: float, values: Mapping[str, float], row: np.ndarray) -> None:
    position = [values[name] for name in _POSITION]
    if not values.get("valid", 1.0) or not np.isfinite(position).all():
        return
    if "yaw" in values:
        half = 0.5 * values["yaw"]
        turn = [np.cos(half), 0.0, 0.0, np.sin(half)]
    else:
        turn = [values[name] for name in _TURN]
    file.pose(topic, time, position, turn)
