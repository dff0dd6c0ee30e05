"""The catch machine as a System."""

from drake_tracker.core.messages import ArmCommand, CatchDiagnosis, Prediction, ServoTarget, ToolStatus, message_size
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP
from drake_tracker.grasp.ball.catch_machine import CatchMachine, CatchObservation, CatchState
from drake_tracker.grasp.machine_system import MachineSystem


class CatchSystem(MachineSystem):
    """Decides where the cup goes, and listens to the operator.

    .. pydrake_system::

        name: CatchSystem
        input_ports:
        - target
        - packet
        - status
        - operator
        output_ports:
        - command
        - object
        - diagnosis
        - ready

    - ``target``: the ball's `ServoTarget`. All zeros, hence not valid: no ball.
    - ``packet``: the `Prediction` of the ball's path. All zeros: none.
    - ``status``: a `ToolStatus`; it is always valid.
    - ``operator``: an `OperatorCommand`. All zeros, or left unconnected: the operator only supervises.
    - ``command``: an `ArmCommand`.
    - ``object``: a `ServoTarget` that stands still where the tool should go, for the transform equation in the place of
      the ball.
    - ``diagnosis``: a `CatchDiagnosis`.
    - ``ready``: 1 while the hand waits in its place, otherwise 0.

    All outputs are state, updated every period in the slot of the grasp machine, which follows that of the servo.

    Args:
        machine: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, machine: CatchMachine, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
        def diagnosis(state: CatchState) -> list[float]:
            if state.crossing is None:
                return [state.phase, 0.0, 0.0, 0.0, 0.0, 0.0, state.motion]
            x, y = state.crossing.place[:2]
            return [state.phase, 1.0, machine.time_left(state), x, y, state.crossing.std, state.motion]

        inputs = {"target": ServoTarget, "packet": message_size(Prediction), "status": ToolStatus}
        outputs = {
            "command": (message_size(ArmCommand), machine.command),
            "object": (message_size(ServoTarget), machine.goal_target),
            "diagnosis": (message_size(CatchDiagnosis), diagnosis),
            "ready": (1, lambda state: [float(machine.is_ready(state))]),
        }
        super().__init__(machine, CatchObservation, inputs, outputs, time_step, period)
