"""The grasp machine as a System."""

from drake_tracker.core.messages import (
    ArmCommand,
    GraspDiagnosis,
    JawState,
    Prediction,
    ServoTarget,
    ToolStatus,
    message_size,
)
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP
from drake_tracker.grasp.machine_system import MachineSystem
from drake_tracker.grasp.train.grasp_machine import GraspMachine, GraspObservation, GraspState


class GraspSystem(MachineSystem):
    """Decides what a hand with jaws does next, and listens to the operator.

    .. pydrake_system::

        name: GraspSystem
        input_ports:
        - target
        - packet
        - jaws
        - status
        - q_commanded
        - operator
        output_ports:
        - command
        - diagnosis
        - goal

    - ``target``: a `ServoTarget`. All zeros, hence not valid: no object.
    - ``packet``: the `Prediction` on which the target rests. All zeros: none.
    - ``jaws``: a `JawState`; it is always valid.
    - ``status``: a `ToolStatus`; it is always valid.
    - ``q_commanded``: the last joint set-points, n values [rad].
    - ``operator``: an `OperatorCommand`. All zeros, or left unconnected: the operator only supervises.
    - ``command``: an `ArmCommand`, which is never all zeros.
    - ``diagnosis``: a `GraspDiagnosis`.
    - ``goal``: a `ServoTarget` at rest where the hand goes in the frame `MotionFrame.GOAL`.

    All outputs are state, updated every period in the slot of the grasp machine, which follows that of the servo.

    Args:
        machine: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, machine: GraspMachine, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
        inputs = {
            "target": ServoTarget,
            "packet": message_size(Prediction),
            "jaws": JawState,
            "status": ToolStatus,
            "q_commanded": machine.model.num_joints,
        }
        outputs = {
            "command": (ArmCommand, machine.command),
            "diagnosis": (GraspDiagnosis, diagnosis_of),
            "goal": (ServoTarget, machine.goal_target),
        }
        super().__init__(machine, GraspObservation, inputs, outputs, time_step, period)


def diagnosis_of(state: GraspState) -> list[float]:
    """Returns the elements of the `GraspDiagnosis` of a state."""
    records = len(state.memory.records)
    return [state.phase, state.attempts, state.gate, state.remembered_error, records, state.p_success]
