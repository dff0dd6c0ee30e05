"""Every model loads, has a body that can exist, and behaves: the gripper grips with its force, the train stands."""

import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Box, Role
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

MODELS = Path(__file__).resolve().parents[2] / "models"
PACKAGE = "package://drake_tracker_models/"
TRAINS = ["plain", "striped", "round", "dark"]
MODEL_FILES = sorted(path.relative_to(MODELS).as_posix() for path in MODELS.glob("*/*.sdf"))
MARKED = "gripper/gripper_marked.sdf"
TABLE_TOP = 0.45
TRAIN_HEIGHT = 0.035
X_WT_DOWN = RigidTransform(RotationMatrix(np.diag([1.0, -1.0, -1.0])), [0.56, 0.0, TABLE_TOP + TRAIN_HEIGHT])


class Scene:
    """Models in one plant, and a Context of the diagram once `build` is called."""

    def __init__(self, time_step=1.0 / 300.0):
        self.builder = DiagramBuilder()
        config = MultibodyPlantConfig(
            time_step=time_step, contact_model="point", discrete_contact_approximation="lagged"
        )
        self.plant, self.scene_graph = AddMultibodyPlant(config, self.builder)
        self.parser = Parser(self.plant)
        self.parser.package_map().AddPackageXml(str(MODELS / "package.xml"))

    def add(self, path, weld=None, X_WF=None):
        (instance,) = self.parser.AddModelsFromUrl(PACKAGE + path)
        if weld is not None:
            frame = self.plant.GetFrameByName(weld, instance)
            self.plant.WeldFrames(self.plant.world_frame(), frame, X_WF or RigidTransform())
        return instance

    def add_arm(self):
        arm = self.add("puma560/puma560.sdf", weld="base")
        gripper = self.add("gripper/gripper.sdf")
        self.plant.WeldFrames(self.plant.GetFrameByName("flange", arm), self.plant.GetFrameByName("hand", gripper))
        return arm, gripper

    def add_gripper_in_the_air(self):
        """Fixes the hand so that the tool points down at a train standing on the table at (.56, 0)."""
        gripper = self.add("gripper/gripper.sdf", weld="tool", X_WF=X_WT_DOWN)
        left, right = (self.plant.GetJointByName(name, gripper) for name in ("finger_left", "finger_right"))
        self.plant.AddCouplerConstraint(left, right, 1.0)
        return left, right

    def build(self):
        self.plant.Finalize()
        self.diagram = self.builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        return self.context

    def place_train(self, height, x=0.56):
        self.plant.SetFreeBodyPose(self.context, self.plant.GetBodyByName("train"), RigidTransform([x, 0.0, height]))

    def train_pose(self):
        return self.plant.GetBodyByName("train").EvalPoseInWorld(self.context)

    def drive(self, effort):
        self.plant.get_actuation_input_port().FixValue(self.context, [effort])

    def simulate(self, duration):
        simulator = Simulator(self.diagram, self.root)
        simulator.AdvanceTo(self.root.get_time() + duration)

    def contact_forces(self):
        """Returns {(name of body, name of body): force on the second [N, W]}, summed over the contact points."""
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        forces = {}
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            names = (self.plant.get_body(info.bodyA_index()).name(), self.plant.get_body(info.bodyB_index()).name())
            force = np.asarray(info.contact_force())
            if names[0] > names[1]:
                names, force = names[::-1], -force
            forces[names] = forces.get(names, np.zeros(3)) + force
        return forces


def tilt_deg(X):
    return np.rad2deg(X.rotation().ToAngleAxis().angle())


def test_each_kind_of_model_is_there():
    expected = ["ball", "cup", "floor", "gripper", "puma560", "seven_joint", "table", "ur5e"]
    files = (
        [f"{name}/{name}.sdf" for name in expected]
        + [f"train/train_{body}.sdf" for body in [*TRAINS, "cube"]]
        + [MARKED]
    )
    assert sorted(files) == MODEL_FILES


@pytest.mark.parametrize("path", MODEL_FILES)
def test_model_loads_and_its_bodies_can_exist(path):
    scene = Scene()
    instance = scene.add(path)
    scene.plant.Finalize()
    for index in scene.plant.GetBodyIndices(instance):
        body = scene.plant.get_body(index)
        inertia = body.default_spatial_inertia()
        assert inertia.IsPhysicallyValid()
        assert inertia.get_mass() > 0.0 or path.startswith("floor") or body.name().startswith("marker_")


def test_markers_change_nothing_but_the_look_of_the_gripper():
    found = []
    for path in ("gripper/gripper.sdf", MARKED):
        scene = Scene()
        gripper = scene.add(path, weld="hand")
        context = scene.build()
        plant, inspector = scene.plant, scene.scene_graph.model_inspector()
        bodies = plant.GetBodyIndices(gripper)
        look = sum(len(plant.GetVisualGeometriesForBody(plant.get_body(index))) for index in bodies)
        mass = plant.CalcMassMatrix(context).tolist(), plant.CalcTotalMass(context)
        contact = inspector.NumGeometriesWithRole(Role.kProximity)
        found.append(((plant.num_positions(), plant.num_actuators(), mass, contact), look))
    (plain, look), (marked, marked_look) = found
    assert plain == marked
    assert marked_look == look + 6


@pytest.mark.parametrize("folder", sorted(path.name for path in MODELS.iterdir() if path.is_dir()))
def test_folder_says_where_it_comes_from(folder):
    assert "drake_tracker authors" in (MODELS / folder / "LICENSE").read_text()
    assert len((MODELS / folder / "README.md").read_text()) > 200


def test_table_top():
    scene = Scene()
    table = scene.add("table/table.sdf", weld="table")
    context = scene.build()
    (top,) = scene.plant.GetCollisionGeometriesForBody(scene.plant.GetBodyByName("table", table))
    inspector = scene.scene_graph.model_inspector()
    half = inspector.GetShape(top).size() / 2.0
    X_WG = scene.plant.GetFrameByName("table").CalcPoseInWorld(context) @ inspector.GetPoseInFrame(top)
    corner = X_WG.translation() + half
    np.testing.assert_allclose(corner, [0.91, 0.50, TABLE_TOP], atol=1e-12)
    assert X_WG.translation()[0] - half[0] > 0.175  # clear of the arm's foot
    assert (MODELS / "table" / "wood.png").stat().st_size < 300_000


def mesh_rows(path, kind):
    lines = (MODELS / path).read_text().splitlines()
    return np.array([line.split()[1:] for line in lines if line.startswith(kind)], dtype=float)


def mesh_vertices(path):
    return mesh_rows(path, "v ")


@pytest.mark.parametrize("path", MODEL_FILES)
def test_meshes_and_textures_are_there(path):
    for url in re.findall(r"<uri>package://drake_tracker_models/(.*?\.obj)</uri>", (MODELS / path).read_text()):
        assert np.all(np.isfinite(mesh_vertices(url))) and np.all(np.isfinite(mesh_rows(url, "vn ")))
        texture = mesh_rows(url, "vt ")
        assert texture.min() >= 0.0 and texture.max() <= 1.0
        folder = (MODELS / url).parent
        (material,) = re.findall(r"^mtllib (.*)$", (MODELS / url).read_text(), re.MULTILINE)
        (image,) = re.findall(r"^map_Kd (.*)$", (folder / material).read_text(), re.MULTILINE)
        assert (folder / image).is_file()


@pytest.mark.parametrize("body", TRAINS)
def test_train_looks_as_large_as_it_is(body):
    vertices = mesh_vertices(f"train/{body}.obj")
    np.testing.assert_allclose(vertices[:, 1].max(), 0.020, atol=5e-4)
    np.testing.assert_allclose(vertices[:, 2].min(), -TRAIN_HEIGHT, atol=5e-4)
    assert np.all(np.abs(vertices) < [0.067, 0.021, 0.036])


@pytest.mark.parametrize("body", TRAINS)
def test_trains_share_mass_inertia_and_collision_geometry(body):
    def physics(name):
        scene = Scene()
        scene.add(f"train/train_{name}.sdf")
        context = scene.build()
        train = scene.plant.GetBodyByName("train")
        inspector = scene.scene_graph.model_inspector()
        geometry = sorted(
            (
                inspector.GetName(i),
                str(inspector.GetShape(i)),
                inspector.GetPoseInFrame(i).translation().tolist(),
                inspector.GetProximityProperties(i).GetProperty("material", "coulomb_friction").static_friction(),
            )
            for i in scene.plant.GetCollisionGeometriesForBody(train)
        )
        return train.CalcSpatialInertiaInBodyFrame(context).CopyToFullMatrix6().tolist(), geometry

    inertia, geometry = physics(body)
    assert (inertia, geometry) == physics("plain")
    assert inertia[3][3] == pytest.approx(0.25)
    assert len(geometry) == 5


def test_train_inertia_is_that_of_its_box():
    scene = Scene()
    scene.add("train/train_plain.sdf")
    context = scene.build()
    train = scene.plant.GetBodyByName("train")
    size = next(
        scene.scene_graph.model_inspector().GetShape(i).size()
        for i in scene.plant.GetCollisionGeometriesForBody(train)
        if isinstance(scene.scene_graph.model_inspector().GetShape(i), Box)
    )
    np.testing.assert_allclose(size, [0.12, 0.04, 0.05])
    expected = 0.25 / 12.0 * (np.sum(size**2) - size**2)
    moments = train.CalcSpatialInertiaInBodyFrame(context).CalcRotationalInertia().get_moments()
    np.testing.assert_allclose(moments, expected, rtol=1e-4)


def test_train_stands_at_its_height_and_rolls_freely():
    scene = Scene()
    scene.add("table/table.sdf", weld="table")
    scene.add("train/train_plain.sdf")
    scene.build()
    scene.place_train(TABLE_TOP + TRAIN_HEIGHT)
    scene.simulate(0.5)
    X_WO = scene.train_pose()
    np.testing.assert_allclose(X_WO.translation(), [0.56, 0.0, TABLE_TOP + TRAIN_HEIGHT], atol=1e-4)
    assert tilt_deg(X_WO) < 0.05
    forces = scene.contact_forces()
    assert list(forces) == [("table", "train")]
    assert forces["table", "train"][2] == pytest.approx(0.25 * 9.81, rel=1e-3)
    # Sliding friction of the wheels: a hundredth, against the table's .6 Drake takes the harmonic mean.
    scene.plant.SetVelocities(scene.context, [0.0, 0.0, 0.0, 0.2, 0.0, 0.0])
    scene.simulate(0.2)
    speed = scene.plant.GetVelocities(scene.context)[3]
    mu = 2.0 * 0.01 * 0.6 / 0.61
    assert speed == pytest.approx(0.2 - mu * 9.81 * 0.2, abs=0.01)


def test_gripper_joints():
    scene = Scene()
    gripper = scene.add("gripper/gripper.sdf", weld="hand")
    context = scene.build()
    plant = scene.plant
    assert [plant.get_joint_actuator(i).name() for i in plant.GetJointActuatorIndices(gripper)] == ["finger_left"]
    assert plant.GetJointActuatorByName("finger_left").effort_limit() == 50.0
    np.testing.assert_allclose(plant.GetPositionLowerLimits(), [0.0, 0.0])
    np.testing.assert_allclose(plant.GetPositionUpperLimits(), [0.045, 0.045])
    assert plant.CalcTotalMass(context, [gripper]) == pytest.approx(0.90)
    X_HT = plant.GetFrameByName("tool").CalcPoseInWorld(context)
    assert X_HT.IsNearlyEqualTo(RigidTransform([0.0, 0.0, 0.15]), 1e-12)


def test_opening_is_the_sum_of_the_fingers_travel():
    scene = Scene()
    scene.add("gripper/gripper.sdf", weld="tool")
    context = scene.build()
    for q in (0.0, 0.020, 0.045):
        scene.plant.SetPositions(context, [q, q])
        left, right = (scene.plant.GetFrameByName(name).CalcPoseInWorld(context) for name in ("jaw_left", "jaw_right"))
        np.testing.assert_allclose(left.translation(), [0.0, q, 0.0], atol=1e-12)
        np.testing.assert_allclose(right.translation(), [0.0, -q, 0.0], atol=1e-12)


def pad_extent(scene):
    """Returns lower and upper corners (3,), in the link's frame, of what the left jaw's collision spheres fill."""
    inspector = scene.scene_graph.model_inspector()
    pads = scene.plant.GetCollisionGeometriesForBody(scene.plant.GetBodyByName("jaw_left"))
    assert len(pads) >= 4
    centres = np.array([inspector.GetPoseInFrame(i).translation() for i in pads])
    radii = np.array([[inspector.GetShape(i).radius()] for i in pads])
    return np.min(centres - radii, axis=0), np.max(centres + radii, axis=0)


def test_pads_touch_on_their_face_and_stay_clear_of_the_table():
    scene = Scene()
    scene.add("gripper/gripper.sdf", weld="tool")
    scene.build()
    lower, upper = pad_extent(scene)
    assert lower[1] == pytest.approx(0.0, abs=1e-12)  # the pad's face is the plane y = 0 of the jaw's frame
    assert upper[0] - lower[0] == pytest.approx(0.044) and upper[2] - lower[2] == pytest.approx(0.026)
    assert upper[2] <= 0.022
    # 13 mm above the table with the tool at a train's centre.
    assert mesh_vertices("gripper/jaw.obj")[:, 2].max() <= 0.022


def test_each_pad_presses_with_half_of_the_drive_and_the_train_is_centred():
    scene = Scene()
    scene.add("train/train_plain.sdf")
    left, right = scene.add_gripper_in_the_air()
    scene.add("table/table.sdf", weld="table")
    context = scene.build()
    scene.place_train(TABLE_TOP + TRAIN_HEIGHT)
    left.set_translation(context, 0.045)
    right.set_translation(context, 0.045)
    scene.drive(-50.0)
    scene.simulate(0.4)
    forces = scene.contact_forces()
    assert abs(forces["jaw_left", "train"][1]) == pytest.approx(25.0, rel=0.01)
    assert abs(forces["jaw_right", "train"][1]) == pytest.approx(25.0, rel=0.01)
    assert left.get_translation(context) == pytest.approx(0.020, abs=2e-4)
    assert right.get_translation(context) == pytest.approx(left.get_translation(context), abs=1e-5)
    assert np.linalg.norm(scene.train_pose().translation() - X_WT_DOWN.translation()) < 5e-4
    assert tilt_deg(scene.train_pose()) < 0.5


def test_gripped_train_hangs_without_slipping_or_tilting():
    scene = Scene()
    scene.add("train/train_plain.sdf")
    left, right = scene.add_gripper_in_the_air()
    context = scene.build()
    scene.place_train(TABLE_TOP + TRAIN_HEIGHT, x=0.575)  # gripped 15 mm off its centre: it wants to tip
    left.set_translation(context, 0.020)
    right.set_translation(context, 0.020)
    scene.drive(-50.0)
    scene.simulate(1.0)
    X_WO = scene.train_pose()
    assert abs(X_WO.translation()[2] - (TABLE_TOP + TRAIN_HEIGHT)) < 1e-3
    assert tilt_deg(X_WO) < 1.0


WORKING = np.array([0.0, 0.8, -2.6, 0.0, -1.3, 0.0])
"""Joints of the PUMA over the table [rad]."""
FOLDED = np.array([0.0, -0.1, -3.9, 0.0, -1.5, 0.0])
"""Joints [rad] at which the PUMA has folded back so far that its hand is in its own column."""


def colliding(plant, context, arm, poses):
    """Whether anything collides with anything in each of these poses of the arm."""
    query_port = plant.get_geometry_query_input_port()
    found = []
    for q in poses:
        plant.SetPositions(context, arm, q)
        found.append(query_port.Eval(context).HasCollisions())
    return found


def around(q, spread=0.5):
    return q + np.random.default_rng(7).uniform(-spread, spread, (200, len(q)))


def test_arm_and_gripper_meet_only_when_the_arm_folds_back_onto_itself():
    scene = Scene()
    arm, _ = scene.add_arm()
    context = scene.build()
    assert not any(colliding(scene.plant, context, arm, around(WORKING)))
    assert colliding(scene.plant, context, arm, [FOLDED]) == [True]


@pytest.mark.parametrize(
    "q_deg, touching",
    [
        ([0.0, -20.0, -90.0, 0.0, 90.0, 0.0], {"link2", "link3", "link5", "hand"}),
        ([0.0, 40.0, -180.0, 0.0, -40.0, 0.0], {"jaw_left", "jaw_right"}),
        ([0.0, 50.0, -180.0, 0.0, -50.0, 0.0], set()),
    ],
)
def test_arm_in_the_table_is_seen(q_deg, touching):
    scene = Scene()
    arm, _ = scene.add_arm()
    scene.add("table/table.sdf", weld="table")
    context = scene.build()
    scene.plant.SetPositions(context, arm, np.deg2rad(q_deg))
    query = scene.plant.get_geometry_query_input_port().Eval(context)
    found = set()
    for pair in query.ComputePointPairPenetration():
        frames = [query.inspector().GetFrameId(i) for i in (pair.id_A, pair.id_B)]
        found |= {scene.plant.GetBodyFromFrameId(frame).name() for frame in frames}
    assert found - {"table"} == touching


def test_ball_is_a_hollow_sphere_of_the_rules():
    scene = Scene()
    scene.add("ball/ball.sdf")
    scene.build()
    ball = scene.plant.GetBodyByName("ball")
    (shell,) = scene.plant.GetCollisionGeometriesForBody(ball)
    radius = scene.scene_graph.model_inspector().GetShape(shell).radius()
    inertia = ball.default_spatial_inertia()
    assert (inertia.get_mass(), radius) == (0.0027, 0.020)
    np.testing.assert_allclose(
        inertia.CalcRotationalInertia().get_moments(), 2.0 / 3.0 * 0.0027 * 0.020**2 * np.ones(3), rtol=1e-9
    )


def test_cup_frames_and_mass():
    scene = Scene()
    cup = scene.add("cup/cup.sdf", weld="hand")
    context = scene.build()
    tool, probe = (scene.plant.GetFrameByName(name, cup).CalcPoseInWorld(context) for name in ("tool", "probe"))
    assert tool.IsNearlyEqualTo(RigidTransform([-0.062, 0.0, 0.160]), 1e-12)
    np.testing.assert_allclose((tool.inverse() @ probe).translation(), [0.0, 0.0, 0.090], atol=1e-12)
    assert scene.plant.CalcTotalMass(context, [cup]) == pytest.approx(0.30)
    vertices = mesh_vertices("cup/hand.obj") - tool.translation()
    in_opening = (np.abs(vertices[:, 0]) < 0.035) & (np.abs(vertices[:, 1]) < 0.045) & (vertices[:, 2] > -0.10)
    assert vertices[in_opening, 2].min() > 0.068, "nothing fills the bowl"
    assert vertices[:, 2].max() == pytest.approx(0.094, abs=2e-4), "the tip's lowest point"


def test_a_ball_dropped_into_the_cup_stays():
    """From the height and with the speed at which it leaves the board: it comes to rest between the walls."""
    scene = Scene(time_step=1.0 / 600.0)
    X_WT = RigidTransform(RotationMatrix(np.diag([-1.0, 1.0, -1.0])), [0.5, 0.0, 0.4])
    scene.add("cup/cup.sdf", weld="tool", X_WF=X_WT)
    scene.add("ball/ball.sdf")
    context = scene.build()
    ball = scene.plant.GetBodyByName("ball")
    scene.plant.SetFreeBodyPose(context, ball, RigidTransform([0.52, 0.02, 0.45]))
    scene.plant.SetVelocities(context, [0.0, 0.0, 0.0, -1.2, 0.0, -0.3])
    scene.simulate(2.0)
    p_TBall = X_WT.inverse() @ ball.EvalPoseInWorld(context).translation()
    assert np.all(np.abs(p_TBall[:2]) <= [0.020 + 1e-3, 0.030 + 1e-3])
    assert p_TBall[2] == pytest.approx(0.050, abs=1e-3)
    assert np.linalg.norm(scene.plant.GetVelocities(context)[3:]) < 0.02


def test_arm_and_cup_meet_only_when_the_arm_folds_back_onto_itself():
    scene = Scene()
    arm = scene.add("puma560/puma560.sdf", weld="base")
    cup = scene.add("cup/cup.sdf")
    scene.plant.WeldFrames(scene.plant.GetFrameByName("flange", arm), scene.plant.GetFrameByName("hand", cup))
    context = scene.build()
    assert not any(colliding(scene.plant, context, arm, around(WORKING)))
    assert colliding(scene.plant, context, arm, [FOLDED + [0.0, 0.0, 0.0, 0.0, 0.0, np.pi]]) == [True]
