"""Plants of one arm alone, for the tests of its kinematics."""

from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

MODELS = Path(__file__).resolve().parents[1] / "models"


def arm_plant(name):
    """Returns the finalized plant of the arm of this name in ``models/``, its base welded to the world."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(MODELS / "package.xml"))
    parser.AddModelsFromUrl(f"package://drake_tracker_models/{name}/{name}.sdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    return plant


def frame_pose(plant, context, q, frame):
    """Returns the pose of a frame in the world, shape (4, 4), at joints q [rad]."""
    plant.SetPositions(context, q)
    return plant.GetFrameByName(frame).CalcPoseInWorld(context).GetAsMatrix4()


def joint6_at(q6, tool_yaw, wanted_yaw):
    """Returns where joint 6 [rad] is when the tool has turned to ``wanted_yaw`` [rad]: pointing down, against z_W."""
    return q6 + tool_yaw - wanted_yaw
