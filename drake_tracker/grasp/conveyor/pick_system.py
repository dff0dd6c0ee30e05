"""The pick machine as a System."""

from drake_tracker.core.messages import (
    ArmCommand,
    JawState,
    PickDiagnosis,
    PickOrder,
    Prediction,
    ServoTarget,
    ToolStatus,
    message_size,
)
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP
from drake_tracker.grasp.conveyor.pick_machine import PickMachine
from drake_tracker.grasp.conveyor.pick_schema import PickObservation, PickState
from drake_tracker.grasp.machine_system import MachineSystem


class PickSystem(MachineSystem):
    """Decides what a hand that carries out orders does next, and listens to the operator.

    .. pydrake_system::

        name: PickSystem
        input_ports:
        - target
        - packet
        - order
        - jaws
        - status
        - arm_state
        - operator
        output_ports:
        - command
        - diagnosis
        - goal

    - ``target``: a `ServoTarget`. All zeros, hence not valid: no part.
    - ``packet``: the `Prediction` on which the target rests. All zeros: none.
    - ``order``: the newest `PickOrder` on the link. All zeros: none.
    - ``jaws``: a `JawState`; it is always valid.
    - ``status``: a `ToolStatus`; it is always valid.
    - ``arm_state``: measured joint positions and velocities, 2 n values [rad, rad/s].
    - ``operator``: an `OperatorCommand`. All zeros, or left unconnected: the operator only supervises.
    - ``command``: an `ArmCommand`, which is never all zeros.
    - ``diagnosis``: a `PickDiagnosis`.
    - ``goal``: a `ServoTarget` at rest where the hand goes in the frame `MotionFrame.GOAL`.

    All outputs are state, updated every period in the slot of the grasp machine, which follows that of the servo.

    Args:
        machine: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, machine: PickMachine, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
        inputs = {
            "target": ServoTarget,
            "packet": message_size(Prediction),
            "order": PickOrder,
            "jaws": JawState,
            "status": ToolStatus,
            "arm_state": 2 * machine.motions.model.num_joints,
        }
        outputs = {
            "command": (ArmCommand, machine.command),
            "diagnosis": (PickDiagnosis, diagnosis_of),
            "goal": (ServoTarget, machine.goal_target),
        }
        super().__init__(machine, PickObservation, inputs, outputs, time_step, period)


def diagnosis_of(state: PickState) -> list[float]:
    """Returns the elements of the `PickDiagnosis` of a state."""
    working = PickOrder(state.order).job if PickOrder(state.order).job > state.done else 0.0
    counts = [state.attempts, state.picked, state.placed, state.failed]
    return [state.phase, working, state.done, *counts, state.gate, state.p_success]
