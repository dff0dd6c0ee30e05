"""The arm over a tilted box: three touches by force alone, and the board's pose from them."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus
from variants import variant

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560_CUP, SEVEN_JOINT
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.plant import add_arm, set_servo_gains
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import TouchReport
from drake_tracker.grasp.ball.board_touch import board_pose_from_touches
from drake_tracker.grasp.ball.touch_diagram import TouchDiagram
from drake_tracker.grasp.ball.touch_machine import TouchPhase, touched_points
from drake_tracker.grasp.config import TouchConfig

MARKS = np.array([[-0.20, 0.12], [0.20, 0.12], [0.0, 0.30]])
RADIUS = 0.004
TILT = np.deg2rad(10.0)
AXES = np.array([[0.0, np.cos(TILT), -np.sin(TILT)], [-1.0, 0.0, 0.0], [0.0, np.sin(TILT), np.cos(TILT)]])
X_WB = RigidTransform(RotationMatrix.MakeZRotation(0.03) @ RotationMatrix(AXES), [0.555, 0.004, 0.50])
PERIOD = 0.005
TIME_STEP = PERIOD / 2  # as in the initialisation of the ball
QUICK = variant(TouchConfig, travel_speed=0.6, clearance=0.005, settle=0.05, reach_below=0.012)()


def touch(description, above, parameters=QUICK, marks=MARKS):
    """Touches the marks from ``above`` [m]. Returns the last report, and the greatest force of contact [N]."""
    builder = DiagramBuilder()
    config = MultibodyPlantConfig(time_step=TIME_STEP, contact_model="point", discrete_contact_approximation="lagged")
    plant, _ = AddMultibodyPlant(config, builder)
    arm = add_arm(plant, description=description).arm
    set_servo_gains(plant, arm, description.servo_inertia, description.servo_bandwidth)
    X_WG = X_WB @ RigidTransform([0.0, 0.45, -0.01])
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, Box(0.6, 0.9, 0.02), "board", CoulombFriction(0.5, 0.5))
    plant.Finalize()
    model = make_arm_model(replace(description, tool_frame="probe"))
    centres = np.array([X_WB @ np.array([*mark, RADIUS]) for mark in marks])
    jogs = np.column_stack([centres + [0.0, 0.0, above], np.full(len(marks), np.pi)])
    q_initial = joints_for(model, description.q_start, tool_down(jogs[0, :3] + [0.0, 0.0, 0.02], np.pi))
    plant.SetDefaultPositions(arm, q_initial)
    touching = builder.AddSystem(TouchDiagram(model, q_initial, jogs, TIME_STEP, PERIOD, parameters))
    builder.Connect(plant.get_state_output_port(arm), touching.GetInputPort("arm_state"))
    builder.Connect(plant.get_net_actuation_output_port(arm), touching.GetInputPort("arm_effort"))
    builder.Connect(touching.GetOutputPort("arm_desired_state"), plant.get_desired_state_input_port(arm))
    builder.Connect(touching.GetOutputPort("arm_feedforward"), plant.get_actuation_input_port(arm))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    forces = [0.0]

    def watch(context):
        contacts = plant.get_contact_results_output_port().Eval(plant.GetMyContextFromRoot(context))
        for i in range(contacts.num_point_pair_contacts()):
            forces.append(np.linalg.norm(contacts.point_pair_contact_info(i).contact_force()))
        report = touching.GetOutputPort("report").Eval(touching.GetMyContextFromRoot(context))
        if TouchReport(report).phase >= TouchPhase.DONE:
            return EventStatus.ReachedTermination(diagram, "touched")
        return EventStatus.DidNothing()

    simulator.set_monitor(watch)
    simulator.AdvanceTo(30.0)
    return touching.GetOutputPort("report").Eval(touching.GetMyContextFromRoot(root)), max(forces)


def test_three_touches_find_the_board():
    report, force = touch(PUMA560_CUP, above=0.008)
    points = touched_points(report)
    found = board_pose_from_touches(points, MARKS, RADIUS)
    error = X_WB.inverse() @ found
    assert np.all(np.abs(error.translation()) < 1e-4)
    assert error.rotation().ToAngleAxis().angle() < np.deg2rad(0.02)
    assert 2.0 < force < 20.0


def test_the_heavier_arm_touches_as_gently():
    report, force = touch(SEVEN_JOINT, above=0.008, marks=MARKS[:1])
    point = X_WB.inverse() @ touched_points(report)[0]
    np.testing.assert_allclose(point, [*MARKS[0], RADIUS], atol=1e-4)
    assert 2.0 < force < 20.0


def test_without_a_board_nothing_is_felt():
    parameters = variant(type(QUICK), descent_speed=0.05)()
    report, force = touch(PUMA560_CUP, above=0.03, parameters=parameters)
    assert force == 0.0
    with pytest.raises(DrakeTrackerError, match="felt nothing below mark 1"):
        touched_points(report)
