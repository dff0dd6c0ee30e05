import numpy as np
import pytest
from ball_scenario import make_scenario
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import VectorLogSink

from drake_tracker.arm.plant import models_parser
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.ball.ball_board import (
    BALL_RADIUS,
    CIRCLE_RADIUS,
    CIRCLES,
    MARK_GAP,
    PEG_GAP,
    PEG_RADIUS,
    START_RANGE,
    START_Y,
    TOUCH_MARKS,
    board_pose,
    draw_board_pose,
    draw_pegs,
    draw_placing_errors,
    draw_start,
    face_corners,
)
from drake_tracker.world.ball.ball_board_visual import face_mesh, mark_mesh, peg_mesh, stand_mesh
from drake_tracker.world.ball.ball_fixtures import GATE_TRAVEL, add_board, add_gate

BOARD = make_scenario().board
GRAVITY = 9.81


class Slope:
    """A ball on the board, without an arm, without a camera."""

    def __init__(self, seed=0, start_x=None, pegs=None, **board):
        scenario = make_scenario(seed, start_x=start_x, **board)
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(
            time_step=1.0 / 600.0, contact_model="point", discrete_contact_approximation="lagged"
        )
        self.plant, _ = AddMultibodyPlant(config, builder)
        (ball,) = models_parser(self.plant).AddModelsFromUrl("package://drake_tracker_models/ball/ball.sdf")
        self.X_WB = draw_board_pose(scenario.board, seed)
        self.pegs = draw_pegs(scenario.board, seed) if pegs is None else pegs
        add_board(self.plant, board=scenario.board, X_WB=self.X_WB, pegs=self.pegs)
        self.start = draw_start(scenario.ball, seed)
        gate = add_gate(self.plant, board_body=self.plant.GetBodyByName("board"), start_x=self.start[0])
        self.plant.Finalize()
        self.ball = self.plant.GetBodyByName("ball")
        log = builder.AddSystem(VectorLogSink(13, 1.0 / 60.0))
        builder.Connect(self.plant.get_state_output_port(ball), log.get_input_port())
        self.simulator = Simulator(builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self._log = log
        self._gate = self.plant.get_desired_state_input_port(gate)
        self.open_gate(GATE_TRAVEL)
        self.put(self.start)

    def open_gate(self, travel):
        self._gate.FixValue(self.context, [travel, 0.0])

    def put(self, p_BBall):
        self.plant.SetFreeBodyPose(self.context, self.ball, RigidTransform(self.X_WB @ p_BBall))

    def run(self, until):
        """Advances to a time [s]; returns times and places (n, 3) of the ball in B [m] since the start."""
        self.simulator.AdvanceTo(until)
        log = self._log.FindLog(self.simulator.get_context())
        return log.sample_times(), self.X_WB.inverse().multiply(log.data()[4:7]).T


def test_frames():
    X_WB = board_pose(BOARD)
    x, y, z = X_WB.rotation().matrix().T
    incline = np.deg2rad(BOARD.incline_deg)
    np.testing.assert_allclose(y, [np.cos(incline), 0.0, np.sin(incline)], atol=1e-15)
    np.testing.assert_allclose(x, [0.0, -1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(X_WB.translation(), BOARD.edge_position)
    assert z[2] > 0.9
    far = X_WB @ face_corners(BOARD)[2]
    np.testing.assert_allclose(far, [0.55 + 0.9 * np.cos(incline), -0.30, 0.50 + 0.9 * np.sin(incline)])


def test_the_seed_places_the_board_within_its_ranges():
    poses = [draw_board_pose(BOARD, seed) for seed in range(200)]
    moved = np.array([X.translation() - BOARD.edge_position for X in poses])
    turned = np.rad2deg([np.arctan2(X.rotation().matrix()[1, 1], X.rotation().matrix()[0, 1]) for X in poses])
    assert np.all(np.abs(moved[:, :2]) <= 0.01) and np.all(moved[:, 2] == 0.0)
    assert np.all(np.abs(turned) <= 2.0)
    assert np.ptp(moved[:, 0]) > 0.018 and np.ptp(turned) > 3.6
    assert poses[7].IsExactlyEqualTo(draw_board_pose(BOARD, 7))


@pytest.mark.parametrize("seed", range(0, 60, 3))
def test_pegs_leave_room_for_ball_and_cup(seed):
    pegs = draw_pegs(BOARD, seed)
    assert 12 <= len(pegs) <= 14
    distance = np.linalg.norm(pegs[:, None] - pegs, axis=2) + np.diag(np.full(len(pegs), np.inf))
    assert distance.min() >= PEG_GAP > 2.0 * (PEG_RADIUS + BALL_RADIUS)
    assert np.all(0.5 * BOARD.width - np.abs(pegs[:, 0]) >= PEG_GAP)
    assert np.all((pegs[:, 1] >= 0.20) & (pegs[:, 1] <= 0.72))
    assert np.linalg.norm(pegs[:, None] - TOUCH_MARKS, axis=2).min() >= MARK_GAP
    assert np.linalg.norm(pegs[:, None] - CIRCLES, axis=2).min() > CIRCLE_RADIUS + PEG_RADIUS
    assert np.array_equal(pegs, draw_pegs(BOARD, seed))


def test_seeds_differ_and_counts_vary():
    layouts = [draw_pegs(BOARD, seed) for seed in range(30)]
    assert {len(pegs) for pegs in layouts} == {12, 13, 14}
    assert not np.array_equal(layouts[0][:5], layouts[1][:5])
    assert len(draw_pegs(make_scenario(peg_count=3).board, 0)) == 3
    assert draw_pegs(make_scenario(peg_count=0).board, 0).shape == (0, 2)


def test_start_and_placing_errors_are_drawn():
    ball = make_scenario().ball
    starts = np.array([draw_start(ball, seed) for seed in range(100)])
    assert np.all(np.abs(starts[:, 0]) <= START_RANGE) and np.ptp(starts[:, 0]) > 0.4
    assert np.all(starts[:, 1:] == [START_Y, BALL_RADIUS])
    assert draw_start(make_scenario(start_x=-0.1).ball, 5)[0] == -0.1
    operator = make_scenario().operator
    errors = np.array([draw_placing_errors(operator, seed) for seed in range(400)])
    assert errors.shape == (400, 3, 2)
    assert errors.std() == pytest.approx(operator.placing_std, rel=0.05)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: draw_pegs(make_scenario(peg_count=200).board, 0), "board.peg_count is 200"),
        (lambda: board_pose(make_scenario(width=0.4).board), "board.width"),
        (lambda: board_pose(make_scenario(incline_deg=0.0).board), "board.incline_deg is 0"),
        (lambda: draw_start(make_scenario(start_x=0.5).ball, 0), "ball.start_x is 0.5"),
    ],
)
def test_what_does_not_fit_is_refused(call, words):
    with pytest.raises(DrakeTrackerError, match=words):
        call()


def test_meshes_lie_where_they_should():
    X_WB = draw_board_pose(BOARD, 3)
    pegs = draw_pegs(BOARD, 3)
    marks, _ = mark_mesh()
    assert 0.0 < marks[:, 2].max() < 0.001
    for centre in CIRCLES:
        rim = marks[np.isclose(np.linalg.norm(marks[:, :2] - centre, axis=1), CIRCLE_RADIUS)]
        np.testing.assert_allclose(rim[:, :2].mean(axis=0), centre, atol=1e-9)
    face, _ = face_mesh(BOARD)
    np.testing.assert_allclose([face[:, 1].min(), face[:, 1].max()], [0.0, BOARD.length])
    vertices, faces = peg_mesh(pegs)
    assert vertices[:, 2].max() > BALL_RADIUS and len(faces) == 22 * len(pegs)
    stand, _ = stand_mesh(BOARD, X_WB, 0.45)
    in_world = X_WB.multiply(stand.T).T
    assert in_world[:, 2].min() == pytest.approx(0.45, abs=1e-9)
    assert np.all(stand[:, 2] < 0.0)


@pytest.mark.parametrize("incline_deg", [5.0, 10.0, 15.0])
def test_the_ball_rolls_freely_as_a_hollow_sphere_does(incline_deg):
    """A = g sin(incline) / (1 + 2/3), from position over time."""
    slope = Slope(incline_deg=incline_deg, pegs=np.empty((0, 2)), start_x=0.05)
    slope.run(0.1)
    slope.put(slope.start)
    slope.plant.SetVelocities(slope.context, slope.plant.GetModelInstanceByName("ball"), np.zeros(6))
    times, places = slope.run(1.1)
    rolling = (times > 0.15) & (places[:, 1] > 0.02)
    acceleration = -2.0 * np.polyfit(times[rolling], places[rolling, 1], 2)[0]
    assert acceleration == pytest.approx(0.6 * GRAVITY * np.sin(np.deg2rad(incline_deg)), rel=0.02)
    assert np.all(np.abs(places[rolling, 2] - BALL_RADIUS) < 1e-4), "it stays on the face"
    assert np.ptp(places[rolling, 0]) < 0.002, "it rolls straight"


def test_the_gate_holds_the_ball_and_lets_it_go():
    slope = Slope(seed=1)
    slope.open_gate(0.0)
    _, places = slope.run(1.0)
    np.testing.assert_allclose(places[-1], slope.start, atol=1e-4)
    slope.open_gate(GATE_TRAVEL)
    _, places = slope.run(1.5)
    free = 0.5 * 0.6 * GRAVITY * np.sin(np.deg2rad(10.0)) * 0.5**2
    assert slope.start[1] - places[-1, 1] == pytest.approx(free, rel=0.3)


def test_a_ball_bounces_off_a_peg():
    slope = Slope(pegs=np.array([[0.0, 0.6]]), start_x=0.0)
    times, places = slope.run(0.9)
    y = places[:, 1]
    lowest = np.argmin(np.where(times < 0.75, y, np.inf))
    assert y[lowest] == pytest.approx(0.6 + PEG_RADIUS + BALL_RADIUS, abs=0.005)
    rebound = (y[lowest + 1 : lowest + 4].max() - y[lowest]) * 20.0
    assert 0.05 < rebound < 0.6


@pytest.mark.parametrize("seed", [0, 7, 12])
def test_the_ball_comes_down(seed):
    slope = Slope(seed)
    _, places = slope.run(3.0)
    off = np.argmax(places[:, 1] < 0.0)
    assert off > 0
    assert np.all(np.abs(places[:off, 0]) < 0.5 * BOARD.width)
