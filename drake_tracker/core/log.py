"""The log of a run: every vector signal between the rooms, with the names of its fields."""

import tokenize
import zipfile
import zlib
from dataclasses import dataclass

import numpy as np
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.arm.arm_model import tool_yaw
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import (
    ArmCommand,
    CatchDiagnosis,
    CatchVerdict,
    Centroid,
    Filtered,
    GraspDiagnosis,
    JawState,
    Prediction,
    ServoTarget,
    ToolStatus,
    TrackPoint,
    Verdict,
)
from drake_tracker.core.timing import BALL_SERVO_PERIOD, SERVO_PERIOD, TIME_STEP, VISION_PERIOD, steps_in

_DAMAGED = (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, tokenize.TokenError)
"""What numpy raises of a file that is not whole: of the disk, of the archive, and of the header of an array in it."""
_BODY_STATE = ["qw", "qx", "qy", "qz", "x", "y", "z", "wx", "wy", "wz", "vx", "vy", "vz"]
_OF_TASK = {
    "train": (("centroid_left", "centroid_right"), SERVO_PERIOD, GraspDiagnosis, Verdict),
    "ball": (("centroid",), BALL_SERVO_PERIOD, CatchDiagnosis, CatchVerdict),
}
"""Centroids, servo period [s], diagnosis and verdict of a task."""


def signals(task="train", num_joints=6):
    """Output ports of `HandEyeDiagram` that are logged: {name: (sampling period [s], names of the fields)}.

    A sample at time t is what the port showed before the updates of that instant. Signals named truth_* come from the
    simulator and were not seen by the loop. Measured vision has no centroids.
    """
    q, v, u = ([f"{letter}{i + 1}" for i in range(num_joints)] for letter in "qvu")
    centroids, servo_period, diagnosis, verdict = _OF_TASK[task]
    return {
        **{name: (VISION_PERIOD, Centroid.get_fields()) for name in centroids},
        "point": (VISION_PERIOD, TrackPoint.get_fields()),
        "filtered": (VISION_PERIOD, Filtered.get_fields()),
        "prediction": (VISION_PERIOD, Prediction.get_fields()),
        "delivered": (VISION_PERIOD, Prediction.get_fields()),
        "target": (servo_period, ServoTarget.get_fields()),
        "command": (servo_period, ArmCommand.get_fields()),
        "status": (servo_period, ToolStatus.get_fields()),
        "diagnosis": (servo_period, diagnosis.get_fields()),
        "q_commanded": (servo_period, q),
        "arm_state": (TIME_STEP, q + v),
        "arm_effort": (TIME_STEP, u),
        **({"jaws": (VISION_PERIOD, JawState.get_fields())} if task == "train" else {}),
        f"truth_{task}_state": (VISION_PERIOD, _BODY_STATE),
        "truth_verdict": (VISION_PERIOD, verdict.get_fields()),
    }


@dataclass(frozen=True)
class Signal:
    """One logged signal: times (n,) [s], data (n, k), names of its k fields."""

    times: np.ndarray
    data: np.ndarray
    names: tuple

    def __getitem__(self, name):
        """Returns one field over time, shape (n,)."""
        return self.data[:, self.names.index(name)]

    def view(self, *names):
        """Returns several fields over time, shape (n, len(names))."""
        return self.data[:, [self.names.index(name) for name in names]]


def add_loggers(builder, hand_eye, task="train"):
    """Logs every port in `signals` that the diagram has; returns {name: VectorLogSink}."""
    loggers = {}
    for name, (period, _) in signals(task).items():
        if not hand_eye.HasOutputPort(name):
            continue
        loggers[name] = LogVectorOutput(hand_eye.GetOutputPort(name), builder, publish_period=period)
        loggers[name].set_name(f"log_{name}")
    return loggers


def read_log(loggers, root_context, task="train"):
    """Returns {name: Signal} of what has been logged so far, of any diagram with ports of these names."""
    joints = loggers["q_commanded"].get_input_port().size() if "q_commanded" in loggers else 6
    fields = signals(task, joints)
    log = {}
    for name, logger in loggers.items():
        record = logger.FindLog(root_context)
        log[name] = Signal(record.sample_times().copy(), record.data().T.copy(), tuple(fields[name][1]))
    return log


def tool_signal(arm_state, model):
    """Returns the Signal of where the tool was (x, y, z [m] in W, yaw [rad]): forward kinematics of the logged
    joints, at the vision period."""
    every = steps_in(VISION_PERIOD)
    rows = []
    for q in arm_state.data[::every, : model.num_joints]:
        X_WT = model.tool_pose(q)
        rows.append([*X_WT.translation(), tool_yaw(X_WT)])
    return Signal(arm_state.times[::every], np.array(rows).reshape(-1, 4), ("x", "y", "z", "yaw"))


def save_log(log, path):
    """Writes a log as one npz file: for each signal its data, ``<signal>.time`` and ``<signal>.names``."""
    arrays = {}
    for name, signal in log.items():
        arrays[name] = signal.data
        arrays[f"{name}.time"] = signal.times
        arrays[f"{name}.names"] = np.array(signal.names)
    np.savez_compressed(path, **arrays)


def load_log(path):
    """Returns {name: Signal} of a file that `save_log` wrote. Raises DrakeTrackerError when it cannot be read."""
    try:
        with np.load(path) as arrays:
            names = [key for key in arrays.files if "." not in key]
            fields = {name: tuple(arrays[f"{name}.names"].tolist()) for name in names}
            data = {name: [_numbers(arrays[key]) for key in (f"{name}.time", name)] for name in names}
            return {name: Signal(*data[name], fields[name]) for name in names}
    except _DAMAGED as error:
        raise DrakeTrackerError(f"{path}: this log is damaged, or was only half written: {error}") from None


def _numbers(array):
    if array.dtype.kind not in "fiu":
        raise ValueError(f"there are arrays of {array.dtype} in it, not of numbers")
    return array
