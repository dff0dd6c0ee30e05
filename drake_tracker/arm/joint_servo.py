"""The joint servos: the plant's own actuator PD control, Drake's inverse dynamics ahead of it, smooth set-points."""

from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.controllers import InverseDynamics

from drake_tracker.arm.set_point_spline_system import SetPointSplineSystem
from drake_tracker.core.timing import SERVO_PERIOD


def actuators_of(plant, instance):
    """Returns the actuators of a model instance, in order. Unlike the plant's own list, also before Finalize()."""
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return [actuator for actuator in actuators if actuator.model_instance() == instance]


def set_servo_gains(plant, instance, inertia, bandwidth):
    """Gives every actuator of a model instance the PD gains Kp = J w^2, Kd = 2 J w. Call before Finalize().

    Args:
      inertia: J, the inertia each actuator is to move [kg m^2 or kg], in the order of the actuators.
      bandwidth: w of each [rad/s].
    """
    for actuator, J, w in zip(actuators_of(plant, instance), inertia, bandwidth, strict=True):
        actuator.set_controller_gains(PdControllerGains(p=J * w**2, d=2.0 * J * w))


def add_joint_feedforward(builder, model, spline):
    """Adds Drake's `InverseDynamics` on the controller's own `ArmModel`, and returns it.

    It computes the torques that gravity, friction and the acceleration of a `SetPointSplineSystem` call for; the
    actuators' PD control then has only the errors to correct.
    """
    dynamics = builder.AddNamedSystem(
        "inverse_dynamics", InverseDynamics(model.plant, InverseDynamics.InverseDynamicsMode.kInverseDynamics)
    )
    builder.Connect(spline.GetOutputPort("desired_acceleration"), dynamics.get_input_port_desired_acceleration())
    return dynamics


def add_set_point_spline(builder, name, set_points, initial, period=SERVO_PERIOD):
    """Adds a `SetPointSplineSystem` behind an output port of set-points, and returns it."""
    spline = builder.AddNamedSystem(name, SetPointSplineSystem(initial, period))
    builder.Connect(set_points, spline.GetInputPort("set_point"))
    return spline
