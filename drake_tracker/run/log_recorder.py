"""Records the vector signals of a run with Drake's loggers."""

from collections.abc import Mapping

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_tracker.arm.arm_model import ArmModel, tool_yaw
from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD, steps_in
from drake_tracker.tasks.task import Task


def add_loggers(builder: DiagramBuilder, hand_eye: Diagram, task: Task) -> dict[str, VectorLogSink]:
    """Adds a logger for each signal of a task that a diagram has as an output port.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: a `HandEyeDiagram`, or another diagram with ports of these names.
        task: task whose signals are logged.

    Returns {name of the signal: its logger}.
    """
    loggers = {}
    for name, (period, _) in task.signals().items():
        if not hand_eye.HasOutputPort(name):
            continue
        loggers[name] = LogVectorOutput(hand_eye.GetOutputPort(name), builder, publish_period=period)
        loggers[name].set_name(f"log_{name}")
    return loggers


def read_log(loggers: Mapping[str, VectorLogSink], root_context: Context, task: Task) -> dict[str, Signal]:
    """Returns {name: Signal} of everything logged so far.

    Args:
        loggers: what `add_loggers` returned.
        root_context: Context of the whole diagram.
        task: task whose signals were logged.
    """
    joints = loggers["q_commanded"].get_input_port().size() if "q_commanded" in loggers else 6
    fields = task.signals(joints)
    log = {}
    for name, logger in loggers.items():
        record = logger.FindLog(root_context)
        log[name] = Signal(record.sample_times().copy(), record.data().T.copy(), tuple(fields[name][1]))
    return log


def tool_signal(arm_state: Signal, model: ArmModel) -> Signal:
    """Returns the pose of the tool over time by forward kinematics of the logged joints, at the vision period.

    Args:
        arm_state: logged joint positions [rad] and velocities [rad/s].
        model: the controller's model of the arm.

    Returns a signal with the fields x, y, z in W [m] and yaw [rad].
    """
    every = steps_in(VISION_PERIOD)
    rows = []
    for q in arm_state.data[::every, : model.num_joints]:
        X_WT = model.tool_pose(q)
        rows.append([*X_WT.translation(), tool_yaw(X_WT)])
    return Signal(arm_state.times[::every], np.array(rows).reshape(-1, 4), ("x", "y", "z", "yaw"))
