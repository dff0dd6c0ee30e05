"""A run in which actions move the hand: the scenario's own diagram, simulated from servo period to servo period."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from pydrake.geometry import ClippingRange, ColorRenderCamera, RenderCameraCore, RenderEngineVtkParams
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import CameraInfo

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import ArmCommand, JawState, Prediction, ServoTarget, ToolStatus, message_size
from drake_tracker.core.system_check import require_renderer
from drake_tracker.core.timing import ESTIMATOR_SLOT, REFLEX_SLOT, SERVO_SLOT, VISION_PERIOD, servo_slot, vision_slot
from drake_tracker.environments.action import ActionMachine
from drake_tracker.figures.studio import looking
from drake_tracker.grasp.machine_system import MachineSystem
from drake_tracker.run.monitor import RunMonitor
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.registry import task_of
from drake_tracker.world.imaging.camera_system import add_renderer

MEASURED_SLOT = ESTIMATOR_SLOT - 1 / 32
"""Fraction of a plant step at which measurements are sampled: just before the host reads them."""
STEP_SLOT = 0.5 * (REFLEX_SLOT + SERVO_SLOT)
"""Fraction of the last plant step of a period at which a step of the environment ends: just before the servo."""
_RENDERER = "observer"


class ActionLoop:
    """A run of a scenario in which an action moves the hand, in place of the task's own decisions.

    Args:
        scenario: the scenario.
        initialisation: the return value of the task's `initialise`.
        model: the controller's model of the arm.
        jaws: the settings with ``jaw_opening`` [m] and ``jaw_speed`` [m/s], None without jaws.
        pictures: whether pictures will be asked for.

    Raises DrakeTrackerError when the scenario cannot be built, or when this machine cannot render what it needs.
    """

    def __init__(self, scenario: BaseScenario, initialisation: Any, model: ArmModel, jaws: Any, pictures: bool) -> None:
        self._scenario, self._task = scenario, task_of(scenario)
        if pictures or self._task.uses_cameras(scenario):
            require_renderer()
        opening, speed = (jaws.jaw_opening, jaws.jaw_speed) if jaws else (0.0, 0.0)
        self._period = self._task.servo_period
        decision = self._make_decision(ActionMachine(model, self._period, opening, speed))
        self.hand_eye = self._task.build(scenario, initialisation, decision)
        if pictures:
            add_renderer(self.hand_eye.world.laboratory.scene_graph, params=RenderEngineVtkParams(), name=_RENDERER)
        self.hand_eye.world.start()
        self._simulator = Simulator(self.hand_eye)
        self._simulator.set_monitor(RunMonitor(self._task, self.hand_eye, None, stop_when_over=False))
        self.context = self._simulator.get_context()
        self._steps = self._cycles = 0

    def _make_decision(self, machine: ActionMachine) -> MachineSystem:
        """Returns the System in place of the task's decision. Its input ``action`` is a command."""
        catch: Any = getattr(self._scenario, "catch", None)  # it is ready after it has gone home and waited
        waits = catch.home_duration + catch.ready_after if catch else 0.0
        inputs: dict[str, Any] = {"packet": message_size(Prediction), "status": ToolStatus, "action": 6}
        inputs |= {"q_commanded": machine.model.num_joints, **({"jaws": JawState} if machine.jaw_opening else {})}
        diagnosis = [0.0] * message_size(self._task.diagnosis)
        outputs = {
            "command": (message_size(ArmCommand), machine.command),
            "goal": (message_size(ServoTarget), machine.goal_target),
            "diagnosis": (len(diagnosis), lambda state: diagnosis),
            "ready": (1, lambda state: [float(state.time >= waits)]),
        }
        return MachineSystem(machine, SimpleNamespace, inputs, outputs, self._scenario.time_step, machine.period)

    def advance(self, command: np.ndarray, sample: Callable[["ActionLoop"], object]) -> None:
        """Simulates until the end of the next step.

        Args:
            command: in effect, shape (6,), see `action`.
            sample: called with this object whenever vision has measured, at the time at which the host reads that.

        Raises DrakeTrackerError when the simulation fails.
        """
        arm, step = self.hand_eye.arm, self._scenario.time_step
        arm.GetInputPort("action").FixValue(arm.GetMyMutableContextFromRoot(self.context), command)
        end = self._steps * self._period + servo_slot(STEP_SLOT, step, self._period)
        try:
            while (at := self._cycles * VISION_PERIOD + vision_slot(MEASURED_SLOT, step)) <= end:
                self._simulator.AdvanceTo(at)
                sample(self)
                self._cycles += 1
            self._simulator.AdvanceTo(end)
        except DrakeTrackerError:
            raise
        except (Exception, SystemExit) as error:
            text = " ".join(str(error).split())
            raise DrakeTrackerError(f"the simulation failed at {self.time:.3f} s: {text}") from error
        self._steps += 1

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.context.get_time())

    def read(self, port: str) -> np.ndarray:
        """Returns the present value of an output port of the diagram, a vector or an image."""
        value = self.hand_eye.GetOutputPort(port).Eval(self.context)
        return np.array(value if isinstance(value, np.ndarray) else value.data)

    def picture(self) -> np.ndarray:
        """Returns a picture of the laboratory, shape (480, 640, 3), RGB."""
        view = self._task.view(self._scenario, self.hand_eye)
        info = CameraInfo(640, 480, np.deg2rad(view.fov_deg))
        camera = ColorRenderCamera(RenderCameraCore(_RENDERER, info, ClippingRange(0.05, 20.0), RigidTransform()))
        query = self.hand_eye.GetOutputPort("truth_query").Eval(self.context)
        world = query.inspector().world_frame_id()
        return query.RenderColorImage(camera, world, looking(view.eye, view.target)).data[:, :, :3].copy()
