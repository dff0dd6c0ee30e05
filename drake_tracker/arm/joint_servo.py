"""The joint servos: actuator PD control with gravity compensation, interpolated set-points, all Drake's own parts."""

import numpy as np
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.primitives import StateInterpolatorWithDiscreteDerivative

from drake_tracker.timing import SERVO_PERIOD


def actuators_of(plant, instance):
    """Returns the actuators of a model instance, in order. Unlike the plant's own list, also before Finalize()."""
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return [actuator for actuator in actuators if actuator.model_instance() == instance]


def set_servo_gains(plant, instance, inertia, bandwidth):
    """Gives every actuator of a model instance the PD gains Kp = I w^2, Kd = 2 I w. Call before Finalize().

    Args:
      inertia: I, the inertia each actuator is to move [kg m^2 or kg], in the order of the actuators.
      bandwidth: w of each [rad/s].
    """
    for actuator, I, w in zip(actuators_of(plant, instance), inertia, bandwidth, strict=True):
        actuator.set_controller_gains(PdControllerGains(p=I * w**2, d=2.0 * I * w))


def add_gravity_compensation(builder, model):
    """Adds Drake's `InverseDynamics` in gravity compensation mode on the controller's own `ArmModel`; returns it."""
    return builder.AddNamedSystem(
        "gravity_compensation", InverseDynamics(model.plant, InverseDynamics.InverseDynamicsMode.kGravityCompensation)
    )


def add_interpolator(builder, name, set_points):
    """Adds Drake's set-point interpolator behind an output port of set-points, and returns it.

    It samples every 30 ms and reaches a set-point 30 ms later; its output is the desired state (q, v).
    """
    interpolator = builder.AddNamedSystem(
        name, StateInterpolatorWithDiscreteDerivative(set_points.size(), SERVO_PERIOD)
    )
    builder.Connect(set_points, interpolator.get_input_port())
    return interpolator


def start_at(interpolator, root_context, q):
    """Makes a set-point interpolator begin at rest at q."""
    interpolator.set_initial_position(interpolator.GetMyMutableContextFromRoot(root_context), np.asarray(q, dtype=float))
