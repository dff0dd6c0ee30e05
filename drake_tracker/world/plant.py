"""The simulated laboratory: arm, gripper, table and train in one MultibodyPlant. Truth lives here and nowhere else."""

from dataclasses import dataclass

from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig

from drake_tracker.arm.description import add_arm, couple_fingers, models_parser
from drake_tracker.arm.joint_servo import set_servo_gains

TRAIN_HEIGHT = 0.035
"""Height of the train's reference point, the centre of its body, above the table [m]."""
TABLE_MODEL_HEIGHT = 0.45
"""Height of the table model's top above its own origin [m]."""


@dataclass(frozen=True)
class Laboratory:
    """The plant, the model instances in it, and of the gripper the bodies of the ``fingers``."""

    plant: object
    scene_graph: object
    arm: object
    gripper: object
    fingers: tuple
    table: object
    train: object
    train_body: object


def add_laboratory(builder, description, train_body, table_height, time_step, decorate=None, grip_force=25.0):
    """Adds the plant and its scene graph to a diagram.

    Args:
      description: an `ArmDescription`. train_body: which train ("plain", "striped", ...). table_height [m].
      time_step: the plant's step [s]. decorate: called with the plant before it is finalized, to add visuals.
      grip_force: on each pad [N].

    Returns Laboratory.
    """
    config = MultibodyPlantConfig(time_step=time_step, contact_model="point", discrete_contact_approximation="lagged")
    plant, scene_graph = AddMultibodyPlant(config, builder)
    parts = add_arm(plant, description)
    couple_fingers(plant, parts.gripper, description, grip_force)
    set_servo_gains(plant, parts.arm, description.servo_inertia, description.servo_bandwidth)
    parser = models_parser(plant)
    (table,) = parser.AddModelsFromUrl("package://drake_tracker_models/table/table.sdf")
    plant.WeldFrames(
        plant.world_frame(),
        plant.GetFrameByName("table", table),
        RigidTransform([0.0, 0.0, table_height - TABLE_MODEL_HEIGHT]),
    )
    (train,) = parser.AddModelsFromUrl(f"package://drake_tracker_models/train/train_{train_body}.sdf")
    if decorate is not None:
        decorate(plant)
    plant.Finalize()
    return Laboratory(
        plant,
        scene_graph,
        parts.arm,
        parts.gripper,
        tuple(plant.GetJointByName(name, parts.gripper).child_body() for name in description.fingers),
        table,
        train,
        plant.GetBodyByName("train", train),
    )


def place_train(laboratory, track, s, table_height):
    """Puts the train at rest on the track at arc length ``s`` [m], in every default Context of the plant."""
    x, y, heading = track.pose(s)
    X_WO = RigidTransform(RotationMatrix.MakeZRotation(heading), [x, y, table_height + TRAIN_HEIGHT])
    laboratory.plant.SetDefaultFloatingBaseBodyPose(laboratory.train_body, X_WO)
