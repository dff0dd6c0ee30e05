"""Tests of the policies: those of the package grasp as their diagrams do, and a new one is short."""

import inspect

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_tracker import DrakeTrackerError, load_scenario, make_diagram, task_of
from drake_tracker.core.errors import PartError
from drake_tracker.core.timing import servo_slot
from drake_tracker.environments import TrackerEnvironment, make_policy, run_episode
from drake_tracker.environments.action import flat_pose
from drake_tracker.environments.action_loop import STEP_SLOT
from drake_tracker.run.monitor import RunMonitor

MEASURED = "vision=!Measured {}"
SEVERAL = "vision=!Measured {method: !SeveralObjects {}}"
SAME = 1e-3
"""Distance at the touch up to which two grasps are the same [m]."""


class Follow:
    """A new policy: goes above the newest point, comes down behind it after a while, and closes the jaws."""

    def reset(self):
        self.point = self.velocity = None
        self.began = 0.0

    def act(self, observation):
        time = observation["time"][0]
        for point in observation["point"]:
            if not point[5]:
                continue
            if self.point is not None and point[0] > self.point[0]:
                velocity = (point[1:4] - self.point[1:4]) / (point[0] - self.point[0])
                self.velocity = velocity if self.velocity is None else 0.9 * self.velocity + 0.1 * velocity
            self.point = point
        if self.velocity is None:
            self.began = time
            return [*observation["tool"], 0.088]
        place = self.point[1:4] + self.velocity * (time + 0.06 - self.point[0])
        yaw = np.arctan2(self.velocity[1], self.velocity[0])
        down = np.clip(time - self.began - 2.0, 0.0, 0.4) / 0.4
        height = 0.22 - 0.216 * down
        closed = time - self.began > 2.45
        lifted = 0.15 if time - self.began > 2.8 else 0.0
        return [place[0], place[1], place[2] + height + lifted, yaw, 0.0 if closed else 0.088]


class Wrong:
    """A policy that does not work."""

    def __init__(self, answer):
        self.answer = answer

    def reset(self):
        pass

    def act(self, observation):
        if self.answer == "raise":
            raise RuntimeError("out of memory")
        return self.answer


def grasp_of_the_diagram(scenario, touches, more):
    """Returns the poses of the tool at the ends of the steps in the scenario's own diagram, until some steps after the
    first touch."""
    task, diagram = task_of(scenario), make_diagram(scenario)
    simulator = Simulator(diagram)
    simulator.set_monitor(RunMonitor(task, diagram, None, stop_when_over=False))
    context, poses, touch = simulator.get_context(), [], None
    while touch is None or len(poses) < touch + more:
        time = len(poses) * task.servo_period + servo_slot(STEP_SLOT, scenario.time_step, task.servo_period)
        simulator.AdvanceTo(time)
        q = diagram.GetOutputPort("arm_state").Eval(context)[: diagram.arm.model.num_joints]
        poses.append(flat_pose(diagram.arm.model.tool_pose(q)))
        if touch is None and touches(task.verdict(diagram.GetOutputPort("truth_verdict").Eval(context))):
            touch = len(poses)
    return np.array(poses)


@pytest.mark.parametrize(
    "name, policy, overrides, touches",
    [
        ("train:guided", "guided", [SEVERAL], lambda verdict: verdict.left_contact or verdict.right_contact),
        ("train", "1991", [MEASURED], lambda verdict: verdict.left_contact or verdict.right_contact),
        ("conveyor", "1991", [MEASURED, "duration=8"], lambda verdict: verdict.held),
    ],
)
def test_a_built_in_policy_grasps_as_its_diagram_does(name, policy, overrides, touches):
    seed = 7 if policy == "guided" else 2
    expected = grasp_of_the_diagram(load_scenario(name, seed=seed, overrides=overrides), touches, 5)
    env = TrackerEnvironment(name, overrides)
    policy = make_policy(policy, env)
    observation, _ = env.reset(seed=seed)
    policy.reset()
    poses = [observation["tool"]]
    while len(poses) < len(expected):
        observation, *_ = env.step(policy.act(observation))
        poses.append(observation["tool"])
    assert touches(env.task.verdict(env._loop.read("truth_verdict")))
    distances = np.linalg.norm(np.array(poses)[:, :3] - expected[:, :3], axis=1)
    assert distances.max() < SAME


@pytest.mark.parametrize("name", ["straight_line", "last_point", "truth"])
def test_a_simple_policy_ends_its_episode(name):
    env = TrackerEnvironment("train:guided", [SEVERAL, "track.speed=0.05"], observe=("joints", "points", "truth"))
    outcome = run_episode(env, make_policy(name, env), seed=2)
    assert outcome["success"] and outcome["reward"] == 1.0 and outcome["time"] < 10.0


def test_the_last_point_is_worth_less_the_later_it_comes():
    env = TrackerEnvironment("train:guided", [SEVERAL, "duration=5.5"], camera_lag=0.5)
    assert not run_episode(env, make_policy("last_point", env), seed=2)["success"]


def test_a_new_policy_is_short_and_grasps():
    assert len([line for line in inspect.getsource(Follow).splitlines() if line.strip()]) <= 40
    env = TrackerEnvironment("train", [MEASURED, "track.speed=0.1", "duration=6"], camera_lag=0.1)
    assert run_episode(env, Follow(), seed=2)["success"]


@pytest.mark.parametrize(
    "answer, message",
    [
        ("raise", r"^Wrong: raised RuntimeError: out of memory \(test_policies.py line \d+\), at 0.029 s"),
        (None, "Wrong: act returned None instead of an action, at 0.029 s"),
        ([np.nan] * 5, "Wrong: an action must be finite"),
    ],
)
def test_a_policy_that_fails_is_named_and_the_environment_goes_on(answer, message):
    env = TrackerEnvironment("train", [MEASURED])
    with pytest.raises(PartError, match=message):
        run_episode(env, Wrong(answer), seed=1)
    env.step(None)
    env.reset(seed=1)


def test_policies_say_what_they_need():
    env = TrackerEnvironment("train", [MEASURED], observe=("joints",))
    with pytest.raises(DrakeTrackerError, match="must observe joints and points"):
        make_policy("1991", env)
    with pytest.raises(DrakeTrackerError, match="no policy 'best' for the train"):
        make_policy("best", env)
