import cv2
import numpy as np
import pytest
from ball_scenario import make_scenario
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560_CUP
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import CatchVerdict
from drake_tracker.world.ball.ball_board import BALL_RADIUS, CIRCLES, draw_board_pose
from drake_tracker.world.ball.ball_camera import NAME
from drake_tracker.world.ball.ball_fixtures import KNOCK
from drake_tracker.world.ball.ball_plant import ASIDE
from drake_tracker.world.ball.ball_world_diagram import BallWorldDiagram
from drake_tracker.world.ball.release_system import draw_delay
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.imaging.cameras import true_camera_model

RIM = 0.43
"""Height of the rim while the cup waits under the edge [m]."""


@pytest.fixture(scope="module")
def model():
    return make_arm_model(PUMA560_CUP)


class Run:
    """A world whose arm stands still with its tool at ``p_WT`` [m]; ``ready`` from the start or never."""

    def __init__(self, model, scenario, p_WT=(0.47, 0.0, 0.55), ready=False, with_camera=True, ball_on_board=True):
        q = joints_for(model, PUMA560_CUP.q_start, tool_down(p_WT, np.pi))
        self.scenario = scenario
        config = WorldConfig(
            arm=PUMA560_CUP,
            q_initial=q,
            windows=None if with_camera else {},
            seed=scenario.seed,
            time_step=scenario.time_step,
        )
        self.world = BallWorldDiagram(
            config, board=scenario.board, ball=scenario.ball, camera=scenario.camera, ball_on_board=ball_on_board
        )
        self.simulator = Simulator(self.world)
        self.root = self.simulator.get_mutable_context()
        scratch = model.plant.CreateDefaultContext()
        model.plant.SetPositions(scratch, q)
        gravity = model.plant.CalcGravityGeneralizedForces(scratch)
        self.fix("arm_desired_state", np.append(q, np.zeros(len(q))))
        self.fix("arm_feedforward", -gravity)
        self.fix("ready", [float(ready)])
        self.laboratory = self.world.laboratory
        self.plant_context = self.laboratory.plant.GetMyMutableContextFromRoot(self.root)

    def fix(self, port, value):
        self.world.GetInputPort(port).FixValue(self.root, value)

    def read(self, port):
        return self.world.GetOutputPort(port).Eval(self.root)

    def verdict(self, time):
        self.simulator.AdvanceTo(time)
        return CatchVerdict(self.read("truth_verdict").copy())

    def put_ball(self, p_BBall):
        X_WBall = RigidTransform(self.laboratory.X_WB @ np.asarray(p_BBall))
        self.laboratory.plant.SetFreeBodyPose(self.plant_context, self.laboratory.ball_body, X_WBall)

    def grey(self):
        return cv2.cvtColor(self.read("camera").data, cv2.COLOR_RGBA2GRAY).astype(float)


@pytest.fixture(scope="module")
def run(model):
    """The standard world, its arm not ready."""
    return Run(model, make_scenario(seed=2))


def test_ports(run):
    world = run.world
    inputs = [world.get_input_port(k).get_name() for k in range(world.num_input_ports())]
    outputs = [world.get_output_port(k).get_name() for k in range(world.num_output_ports())]
    assert inputs == ["arm_desired_state", "arm_feedforward", "ready"]
    assert outputs == ["camera", "arm_state", "arm_effort", "truth_ball_state", "truth_verdict", "truth_query"]
    assert world.get_name() == "world"


def test_without_a_camera_there_is_no_renderer(model):
    world = Run(model, make_scenario(), with_camera=False).world
    assert not world.HasOutputPort("camera") and not world.cameras
    assert world.laboratory.scene_graph.RendererCount() == 0


def test_the_circles_are_dark_on_a_light_board_and_where_they_should_be(run):
    camera = true_camera_model(run.scenario.camera, run.world.cameras[NAME].X_WC)
    X_WB = run.laboratory.X_WB
    image = run.grey()
    for x, y in CIRCLES:
        inside, beside = camera.project([X_WB @ [x, y, 0.0], X_WB @ [0.75 * x, y - 0.06 * np.sign(y - 0.4), 0.0]])
        (u, v), (ub, vb) = np.rint([inside, beside]).astype(int)
        assert image[v, u] < 30.0
        assert 150.0 < image[vb, ub] < 240.0


def test_the_ball_is_seen_by_its_shading_only(run):
    """White on white: it changes the image where it is, by little, and nowhere else."""
    camera = true_camera_model(run.scenario.camera, run.world.cameras[NAME].X_WC)
    place = np.array([0.15, 0.12, BALL_RADIUS])
    without = run.grey()
    run.put_ball(place)
    change = np.abs(run.grey() - without)
    run.put_ball(run.laboratory.p_BoBall)
    u, v = camera.project(run.laboratory.X_WB @ place)[0]
    here = change[int(v) - 10 : int(v) + 11, int(u) - 10 : int(u) + 11]
    assert here.max() > 20.0
    middle = without[int(v) - 2 : int(v) + 3, int(u) - 2 : int(u) + 3]
    assert np.abs(change[int(v) - 2 : int(v) + 3, int(u) - 2 : int(u) + 3]).mean() < 0.3 * middle.mean()
    start = camera.project(run.laboratory.X_WB @ run.laboratory.p_BoBall)[0]
    rows, columns = np.nonzero(change > 12.0)
    near = [np.hypot(columns - a, rows - b) < 12.0 for a, b in ((u, v), start)]
    assert np.all(near[0] | near[1])


@pytest.mark.parametrize("seed", [2, 5])
def test_the_ball_waits_for_the_arm_and_then_rolls(model, seed):
    run = Run(model, make_scenario(seed=seed), with_camera=False)
    assert run.verdict(0.6).released == 0.0
    run.fix("ready", [1.0])
    verdict = run.verdict(4.5)
    assert verdict.released == pytest.approx(0.6 + draw_delay(seed), abs=0.2)
    assert 1.2 < verdict.crossing_time - verdict.released < 3.0
    assert abs(verdict.crossing_x) < 0.30
    assert verdict.left_board >= verdict.crossing_time
    assert (verdict.lost, verdict.caught) == (1.0, 0.0), "nobody caught it"


def test_a_ball_that_is_not_to_be_released_stays(model):
    run = Run(model, make_scenario(seed=2, release=False), with_camera=False, ready=True)
    assert run.verdict(2.0).released == 0.0


def test_a_cup_in_the_right_place_catches(model):
    scenario = make_scenario(seed=2, peg_count=0, start_x=0.1)
    X_WB = draw_board_pose(scenario.board, scenario.seed)
    x, y, _ = X_WB @ np.array([0.1, -0.075, 0.0])
    run = Run(model, scenario, with_camera=False, ready=True, p_WT=(x, y, RIM))
    verdict = run.verdict(draw_delay(2) + 2.8)
    assert (verdict.caught, verdict.lost, verdict.board_touched) == (1.0, 0.0, 0.0)
    assert verdict.held > 1.0 and verdict.in_cup == 1.0
    assert verdict.height == pytest.approx(RIM - 0.070 + BALL_RADIUS, abs=0.005)


def test_the_ball_may_lie_aside(model):
    run = Run(model, make_scenario(), with_camera=False, ball_on_board=False)
    np.testing.assert_allclose(run.read("truth_ball_state")[4:7], ASIDE)
    assert run.verdict(0.2).height == pytest.approx(BALL_RADIUS, abs=1e-3)


def test_a_knock_moves_the_board_and_what_stands_on_it(model):
    run = Run(model, make_scenario(seed=2, knock_time=0.3), with_camera=False)
    board = run.laboratory.board_body

    def shift():
        return (run.laboratory.X_WB.inverse() @ board.EvalPoseInWorld(run.plant_context)).translation()

    run.simulator.AdvanceTo(0.29)
    np.testing.assert_allclose(shift(), 0.0, atol=1e-9)
    run.simulator.AdvanceTo(0.6)
    np.testing.assert_allclose(shift(), [KNOCK, 0.0, 0.0], atol=1e-5)


def test_the_distractor_moves_in_view_beside_the_board(model):
    run = Run(model, make_scenario(seed=2, distractor=True))
    first = run.grey()
    run.simulator.AdvanceTo(1.0)
    change = np.abs(run.grey() - first) > 15.0
    camera = true_camera_model(run.scenario.camera, run.world.cameras[NAME].X_WC)
    corners = run.laboratory.X_WB.multiply(np.array([[0.31, 0.31, -0.31, -0.31], [0, 0.9, 0.9, 0], [0.0] * 4])).T
    face = cv2.fillConvexPoly(np.zeros(change.shape, np.uint8), np.rint(camera.project(corners)).astype(int), 1)
    assert change.sum() > 30
    assert (change & (face > 0)).sum() < 0.2 * change.sum()
