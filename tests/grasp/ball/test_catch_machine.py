from dataclasses import replace

import numpy as np
import pytest
from catches import PERIOD, X_WB, ball_packet, edge, packets_of, play
from slopes import STEP, points_of, roll, to_world

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.core.messages import ArmCommand, OperatorCommand, Prediction, ServoTarget, ToolStatus, message_size
from drake_tracker.estimation import make_estimator
from drake_tracker.grasp.ball.catch_machine import CatchMachine, CatchObservation
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.config import CatchConfig

NOTHING = np.zeros(message_size(Prediction))
PARAMETERS = CatchConfig()
LAG = 0.12


class Bench:
    """Ticks of a CatchMachine; the hand is at once where it was sent."""

    def __init__(self, **changes):
        self.machine = CatchMachine(CatchConfig(**changes), edge(), PERIOD)
        self.state = self.machine.initial_state()
        self.time = 5.0
        self.commands = []

    def tick(self, packet=NOTHING, valid=None, operator=(0, 0, 0, 0, 0), fraction=1.0):
        command = ArmCommand(self.machine.command(self.state))
        goal = self.machine.edge.home if command.frame == MotionFrame.HOME else self.state.goal
        pose = [*goal[:2], goal[2] + command.height, goal[3]]
        valid = Prediction(packet).valid if valid is None else valid
        self.state = self.machine.update(
            self.state,
            CatchObservation(
                self.time,
                ServoTarget(np.append(np.zeros(13), valid)),
                packet,
                ToolStatus(np.array([command.motion, fraction, 0.0, *pose, 0.0])),
                OperatorCommand(np.array([*operator, 0.0])),
            ),
        )
        self.commands.append(ArmCommand(self.machine.command(self.state)))
        self.time += PERIOD
        return self.state.phase

    def ball(self, arrival, x=0.0, age=LAG):
        """A tick with a fresh packet of a ball that arrives then."""
        return self.tick(ball_packet(self.time - age, arrival, x))

    def until(self, phase, arrival, x=0.0, limit=600):
        for _ in range(limit):
            if self.ball(arrival, x) == phase:
                return self.time - PERIOD
        raise AssertionError(f"never in {phase.name}: {self.state.phase.name}")


@pytest.fixture
def bench():
    return Bench()


def test_the_whole_catch(bench):
    for _ in range(20):
        assert bench.tick() == CatchPhase.WAIT
    arrival = bench.time + 1.0
    assert bench.ball(arrival) == CatchPhase.FOLLOW
    assert bench.until(CatchPhase.SETTLE, arrival) == pytest.approx(arrival - PARAMETERS.settle_time, abs=1.1 * PERIOD)
    cupped = bench.until(CatchPhase.CUP, arrival)
    assert cupped == pytest.approx(arrival, abs=1.1 * PERIOD)
    packet = ball_packet(arrival - LAG, arrival, 0.0)  # nothing new comes once the ball is off the board
    while bench.tick(packet) == CatchPhase.CUP:
        pass
    assert bench.state.phase == CatchPhase.RAISE
    assert bench.time == pytest.approx(cupped + PARAMETERS.rest_time, abs=2.1 * PERIOD)
    assert bench.commands[-1].frame == MotionFrame.HELD
    assert bench.commands[-1].height - bench.commands[-2].height == pytest.approx(0.12)
    for _ in range(400):
        bench.tick(packet, valid=0.0)
    assert bench.state.phase == CatchPhase.HOLD


def test_the_goal_is_the_predicted_place_and_moves_only_with_it(bench):
    arrival = bench.time + 1.2
    for _ in range(5):
        bench.ball(arrival, x=0.10)
    np.testing.assert_allclose(bench.state.goal, edge().place(0.10), atol=1e-4)
    motion = bench.state.motion
    for _ in range(5):
        bench.ball(arrival, x=0.1015)
    assert bench.state.motion == motion
    bench.ball(arrival, x=0.11)
    assert bench.state.motion == motion + 1
    np.testing.assert_allclose(bench.state.goal, edge().place(0.11), atol=1e-4)
    vector = ServoTarget(bench.machine.goal_target(bench.state))
    assert vector.valid == 1.0 and [vector.x, vector.y, vector.z, vector.yaw] == list(bench.state.goal)
    assert [vector.vx, vector.vy, vector.vz, vector.yaw_rate] == [0.0] * 4


def test_a_longer_distance_takes_longer(bench):
    arrival = bench.time + 1.2
    bench.ball(arrival, x=0.005)
    assert bench.commands[-1].duration == PARAMETERS.shortest_motion
    for _ in range(3):
        bench.ball(arrival, x=0.02)
    bench.ball(arrival, x=-0.2)
    assert bench.commands[-1].duration == pytest.approx(0.22 / 0.75 * 4 / 3, abs=0.02)


def test_shortly_before_the_ball_arrives_the_cup_stands_still_unless_it_must_move(bench):
    arrival = bench.time + 1.0
    bench.until(CatchPhase.SETTLE, arrival)
    goal, motion = bench.state.goal, bench.state.motion
    for _ in range(5):
        assert bench.ball(arrival, x=0.004) == CatchPhase.SETTLE
    assert bench.state.goal is goal and bench.state.motion == motion
    assert bench.ball(arrival, x=0.04) == CatchPhase.FOLLOW
    np.testing.assert_allclose(bench.state.goal, edge().place(0.04), atol=1e-4)
    assert bench.ball(arrival, x=0.04) == CatchPhase.SETTLE
    assert bench.state.motion > motion


def test_the_cup_waits_for_a_ball_that_is_delayed(bench):
    arrival = bench.time + 1.0
    bench.until(CatchPhase.CUP, arrival)
    assert bench.ball(bench.time + 0.5, x=0.05) == CatchPhase.FOLLOW
    assert bench.until(CatchPhase.CUP, bench.time + 0.5, x=0.05)


def test_the_cup_does_not_catch_a_ball_that_is_no_longer_seen(bench):
    """It lies jammed at a peg: nothing moves, no point, no packet."""
    arrival = bench.time + 0.9
    packet = ball_packet(bench.time - LAG, arrival, 0.1)
    while bench.time < arrival + PARAMETERS.rest_time - 2 * PERIOD:
        assert bench.tick(packet) == CatchPhase.FOLLOW
    for _ in range(6):
        bench.tick(packet)
    assert bench.state.phase == CatchPhase.WAIT
    assert bench.tick(packet) == CatchPhase.WAIT  # the old packet does not call it out again
    assert bench.ball(bench.time + 0.8) == CatchPhase.FOLLOW


@pytest.mark.parametrize("phase", [CatchPhase.SETTLE, CatchPhase.CUP])
def test_the_cup_waits_for_a_ball_that_is_deflected_up_the_slope(bench, phase):
    """What is foreseen of it now ends on the board: the crossing that was foreseen before is void."""
    arrival = bench.time + 1.0
    bench.until(phase, arrival)
    for _ in range(60):
        bench.tick(ball_packet(bench.time - LAG, bench.time + 1.9, 0.02, speed=1.2))
    assert bench.state.phase == CatchPhase.FOLLOW and bench.machine.time_left(bench.state) > 1.0
    arrival = bench.time + 0.9
    assert bench.until(CatchPhase.CUP, arrival, x=0.02) == pytest.approx(arrival, abs=1.1 * PERIOD)


def test_the_phase_of_a_hand_that_stays_in_the_middle_does_not_depend_on_the_crossing():
    bench = Bench(follow=False)
    arrival, phases = bench.time + 1.0, []
    while bench.time < arrival + 0.1:
        phases.append(bench.ball(arrival, x=0.15))
    assert sum(a != b for a, b in zip(phases, phases[1:], strict=False)) == 2


def test_a_path_that_does_not_reach_the_edge_moves_nothing(bench):
    for _ in range(20):
        assert bench.tick(ball_packet(bench.time, bench.time + 1.7, 0.0, speed=1.2)) == CatchPhase.WAIT
    assert bench.machine.time_left(bench.state) == np.inf


def test_it_is_ready_after_standing_for_a_while(bench):
    assert not bench.machine.is_ready(bench.state)
    for _ in range(100):
        bench.tick(fraction=0.9)
    assert not bench.machine.is_ready(bench.state)
    first = bench.time
    while not bench.machine.is_ready(bench.state):
        bench.tick()
    assert bench.time - first == pytest.approx(PARAMETERS.ready_after, abs=2.1 * PERIOD)
    bench.ball(bench.time + 1.0)
    assert not bench.machine.is_ready(bench.state)


@pytest.mark.parametrize("phase", [phase for phase in CatchPhase if phase != CatchPhase.STOPPED])
def test_the_operator_stops_it_in_every_phase(bench, phase):
    bench.until(CatchPhase.FOLLOW, bench.time + 0.8, 0.1)
    for _ in range(3):
        bench.ball(bench.time + 0.8, 0.1)
    bench.state = replace(bench.state, phase=phase, entered=bench.time)
    command = ArmCommand(bench.machine.command(bench.state))
    at = (edge().home if command.frame == MotionFrame.HOME else bench.state.goal) + [0.0, 0.0, command.height, 0.0]
    bench.state = replace(bench.state, tool=at)  # it stands
    assert bench.tick(operator=(1, 0, 0, 0, 0)) == CatchPhase.STOPPED
    np.testing.assert_allclose(bench.state.goal, at, atol=1e-12)
    assert bench.commands[-1].height == 0.0 and bench.commands[-1].frame == MotionFrame.OBJECT
    for _ in range(5):
        coming = ball_packet(bench.time, bench.time + 0.3, 0.0)
        assert bench.tick(coming, operator=(1, 0, 0, 0, 0)) == CatchPhase.STOPPED
    np.testing.assert_allclose(bench.state.goal, at, atol=1e-12)
    assert bench.tick() == CatchPhase.WAIT


def test_the_operator_takes_over_and_lets_go(bench):
    pose = (2, 0.45, 0.1, 0.7, 3.0)
    assert bench.tick(operator=pose) == CatchPhase.MANUAL
    np.testing.assert_array_equal(bench.state.goal, pose[1:])
    motion = bench.state.motion
    for _ in range(10):
        bench.tick(operator=pose)
    assert bench.state.motion == motion
    bench.tick(operator=(2, 0.45, 0.1, 0.72, 3.0))
    assert bench.state.motion == motion + 1
    bench.tick(operator=(2, np.nan, 0.1, 0.7, 3.0))
    assert np.all(np.isfinite(bench.state.goal))
    assert bench.tick(operator=(1, 0, 0, 0, 0)) == CatchPhase.STOPPED
    assert bench.tick(operator=pose) == CatchPhase.MANUAL
    assert bench.tick() == CatchPhase.WAIT


def test_an_unknown_mode_is_a_stop(bench):
    for mode in (3.0, -1.0, 0.5, np.nan):
        assert Bench().tick(operator=(mode, 0, 0, 0, 0)) == CatchPhase.STOPPED


def test_most_balls_among_pegs_end_over_the_cup():
    """A hand within its speed and acceleration; what the estimator says of 16 balls, known 0.1 s late."""
    paths, times, _ = roll(16, seed=11)
    estimator, rng, caught = make_estimator("inclined_plane", X_WB=X_WB), np.random.default_rng(4), []
    for path, end in zip(paths.transpose(1, 0, 2), times):
        stamps, points = points_of(path, end, rng, phase=rng.random())
        machine = CatchMachine(PARAMETERS, edge(), PERIOD)
        begins = 0.2
        rows, state = play(machine, packets_of(estimator, stamps + begins, to_world(points, X_WB)), end + begins + 0.6)
        i = round(end / STEP)
        vx, vy = (path[i] - path[i - 10]) / (10 * STEP)
        over = machine.edge.beyond / -vy
        tool = rows[round((end + begins + over) / PERIOD), 2:]
        ball = edge().place(path[i, 0] + vx * over)[:3] + [0.0, 0.0, PARAMETERS.rim_height]
        caught.append(np.linalg.norm(tool - ball) < 0.030)
        assert state.phase == CatchPhase.RAISE
    assert np.mean(caught) >= 0.75
