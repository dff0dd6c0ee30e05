"""The arm's computer as a Diagram: from the receiver of packets to the joint servos."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import MatrixGain

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.config import ServoConfig
from drake_tracker.arm.hand_eye_correction import HandEyeCorrection
from drake_tracker.arm.hand_eye_correction_system import HandEyeCorrectionSystem
from drake_tracker.arm.motion.servo_system import add_servo
from drake_tracker.arm.motion.set_point_spline_system import add_set_point_spline
from drake_tracker.arm.motion.tool_controller import add_tool_controller
from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.arm.motion.tool_yaw import flip_speed
from drake_tracker.arm.motion.transform_equation import LEVEL, Slope
from drake_tracker.arm.safety.packet_guard import PacketGuard
from drake_tracker.arm.safety.packet_guard_system import make_packet_guard_system
from drake_tracker.core.messages import ArmCommand, message_size
from drake_tracker.core.timing import SERVO_PERIOD

_ANSWERED = {"target": "servo", "status": "transform_equation", "q_commanded": "joint_limiter"}
"""Inputs of the decision that are answered within the arm: {port: the System that has the output}."""


class ArmDiagram(Diagram):
    """From packets of predicted path to joint and jaw set-points.

    .. pydrake_system::

        name: ArmDiagram
        input_ports:
        - packet
        - arm_state
        - arm_effort
        - jaws
        - operator
        output_ports:
        - arm_desired_state
        - arm_feedforward
        - gripper_desired_state
        - accepted
        - packet_report
        - target
        - command
        - status
        - diagnosis
        - goal
        - q_commanded
        - limiter_report

    - ``packet``: the newest `Prediction` on the link. All zeros: none has arrived.
    - ``arm_state``: measured joint positions and velocities, 2 n values [rad, rad/s].
    - ``arm_effort``: torques of the drives, n values [N m]. Unconnected: the arm has no reflex on collisions.
    - ``jaws``: a `JawState`.
    - ``operator``: an `OperatorCommand`. Unconnected: the operator only supervises.
    - ``hand_point``, with ``edge`` only: the newest `HandPoint` on the link.
    - ``arm_desired_state``: desired joint positions and velocities, 2 n values [rad, rad/s].
    - ``arm_feedforward``: torques for gravity, friction and acceleration, n values [N m].
    - ``gripper_desired_state``: desired position and velocity of the driven finger, 2 values [m, m/s].
    - ``accepted``: the newest packet that the arm may follow, a `Prediction`, for displays. All zeros: none yet.
    - ``packet_report``: counts of accepted and rejected packets, a `PacketReport`, for logs.
    - ``target``: the object as the servo estimates it, a `ServoTarget`, for logs. All zeros: nothing estimated yet.
    - ``command``: the decision's `ArmCommand`, for logs.
    - ``status``: a `ToolStatus`, for logs.
    - ``diagnosis``: reasons of the decision, for logs; its message type depends on the decision.
    - ``goal``: where the hand goes under the operator's control, a `ServoTarget`.
    - ``q_commanded``: joint set-points, n values [rad], for logs.
    - ``limiter_report``: interventions of the joint limiter, a `LimiterReport`, for logs.
    - ``hand_correction``, with ``edge`` only: the correction that is subtracted from the target before the transform
      equation, a `HandCorrection`, for logs.

    The first three outputs drive the robot; the desired states are continuous in time. The others are updated every
    period in the slots of the servo. Without a hand that has jaws, there are no ports ``jaws`` and
    ``gripper_desired_state``. Every other input or output port of the decision is a port of the diagram.

    Args:
        decision: the System that decides on the motion of the hand, such as `drake_tracker.grasp.GraspSystem`. It needs
            inputs ``target``, ``packet`` and ``status`` and outputs ``command`` and ``diagnosis``. With an input
            ``jaws`` it has jaws to move. An output ``object`` (a `ServoTarget`) replaces the servo's estimate as the
            place of the hand; an output ``goal`` (also a `ServoTarget`) does so only in motions in the frame
            `MotionFrame.GOAL`.
        guard: decides which packets the arm follows.
        servo: parameters of the trajectory generator.
        model: the controller's model of the arm.
        q_initial: joint positions at the start, shape (n,) [rad].
        home: reference pose (x, y, z, yaw) in W, shape (4,) [m, rad], over which the hand waits.
        time_step: the plant's step [s].
        period: period of the set-points [s].
        jaw_opening: opening of the jaws at the start [m].
        clearance: distances that the limiter of the joints keeps; None: it keeps none.
        edge: corrects the target by the cameras' measurements of the hand; None: nothing does.
        swings: whether the hand goes far about the base, see `ToolMotion`.
        object_yaw: direction in W of an object that does not turn with its path [rad]; None: it points along its path.
        slope: of the surface on which objects move, see `ToolMotion`.

    Attributes:
        model: as given.
    """

    def __init__(
        self,
        decision: System,
        guard: PacketGuard,
        servo: ServoConfig,
        model: ArmModel,
        q_initial: Sequence[float] | np.ndarray,
        home: np.ndarray,
        time_step: float,
        period: float = SERVO_PERIOD,
        *,
        jaw_opening: float = 0.0,
        clearance: ArmClearance | None = None,
        edge: HandEyeCorrection | None = None,
        swings: bool = False,
        object_yaw: float | None = None,
        slope: Slope | None = LEVEL,
    ) -> None:
        super().__init__()
        self.set_name("arm")
        self.model = model
        builder = DiagramBuilder()
        packet_guard = builder.AddSystem(make_packet_guard_system(guard, time_step))
        servo_system = add_servo(
            builder,
            settings=servo,
            packet=packet_guard.GetOutputPort("accepted"),
            time_step=time_step,
            period=period,
            yaw=object_yaw,
        )
        builder.AddSystem(decision)
        target = servo_system.GetOutputPort("target")
        if edge is not None:
            visual_edge = builder.AddNamedSystem("visual_edge", HandEyeCorrectionSystem(edge, model, time_step))
            builder.Connect(target, visual_edge.GetInputPort("target"))
            builder.ExportInput(visual_edge.GetInputPort("hand_point"), "hand_point")
            target = visual_edge.GetOutputPort("corrected")
        command = decision.GetOutputPort("command")
        own_goal = decision.HasOutputPort("object")
        controller = add_tool_controller(
            builder,
            motion=ToolMotion(
                home,
                period,
                model.symmetric_hand,
                moving=not own_goal,
                swings=swings,
                flip_speed=flip_speed(float(model.velocity_limit[-1])),
                slope=slope,
            ),
            model=model,
            q_initial=q_initial,
            target=decision.GetOutputPort("object") if own_goal else target,
            command=command,
            time_step=time_step,
            period=period,
            clearance=clearance,
        )

        if decision.HasOutputPort("goal"):
            builder.Connect(decision.GetOutputPort("goal"), controller.transform_equation.GetInputPort("goal"))
        builder.Connect(command, servo_system.GetInputPort("command"))
        builder.Connect(servo_system.GetOutputPort("held_packet"), decision.GetInputPort("packet"))
        builder.ExportInput(packet_guard.GetInputPort("packet"), "packet")
        builder.ExportInput(controller.inverse_dynamics.get_input_port_estimated_state(), "arm_state")
        for index in range(decision.num_input_ports()):
            port = decision.get_input_port(index)
            if port.get_name() in _ANSWERED:
                source = builder.GetSubsystemByName(_ANSWERED[port.get_name()])
                builder.Connect(source.GetOutputPort(port.get_name()), port)
            elif port.get_name() == "arm_state":
                builder.ConnectInput("arm_state", port)
            elif port.get_name() != "packet":
                builder.ExportInput(port, port.get_name())

        if decision.HasInputPort("jaws"):
            half_width = np.zeros((1, message_size(ArmCommand)))
            half_width[0, ArmCommand.get_fields().index("jaw_width")] = 0.5
            finger = builder.AddNamedSystem("finger_set_point", MatrixGain(half_width))
            builder.Connect(command, finger.get_input_port())
            fingers = add_set_point_spline(
                builder,
                name="finger_spline",
                set_points=finger.get_output_port(),
                initial=[0.5 * jaw_opening],
                period=period,
            )
            builder.ExportOutput(fingers.GetOutputPort("desired_state"), "gripper_desired_state")

        builder.ConnectInput("arm_state", controller.reflex.GetInputPort("arm_state"))
        if edge is not None:
            builder.ConnectInput("arm_state", visual_edge.GetInputPort("arm_state"))
            builder.ExportOutput(visual_edge.GetOutputPort("hand_correction"), "hand_correction")
        builder.ExportInput(controller.reflex.GetInputPort("arm_effort"), "arm_effort")
        builder.ExportOutput(controller.spline.GetOutputPort("desired_state"), "arm_desired_state")
        builder.ExportOutput(controller.inverse_dynamics.get_output_port_generalized_force(), "arm_feedforward")
        for name in ("accepted", "packet_report"):
            builder.ExportOutput(packet_guard.GetOutputPort(name), name)
        builder.ExportOutput(servo_system.GetOutputPort("target"), "target")
        builder.ExportOutput(controller.transform_equation.GetOutputPort("status"), "status")
        for name in ("q_commanded", "limiter_report"):
            builder.ExportOutput(controller.limiter.GetOutputPort(name), name)
        for index in range(decision.num_output_ports()):
            builder.ExportOutput(decision.get_output_port(index), decision.get_output_port(index).get_name())
        builder.BuildInto(self)
