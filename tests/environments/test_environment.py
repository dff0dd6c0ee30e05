"""Tests of the environments: Gymnasium's checker, the same episode for the same seed, wrong actions, the end."""

import hashlib
import os

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import drake_tracker.environments
from drake_tracker import DrakeTrackerError, load_scenario
from drake_tracker.environments.environment import TrackerEnvironment
from drake_tracker.environments.measurements import point_ports

MEASURED = "vision=!Measured {}"
SEVERAL = "vision=!Measured {method: !SeveralObjects {}}"
PERIOD = 0.03


def make(**settings):
    return TrackerEnvironment(overrides=[MEASURED], **settings)


@pytest.fixture(scope="module")
def env():
    return make(observe=("joints", "points", "truth"))


def sway(observation, k):
    """An action that moves the hand to and fro above the table."""
    yaw = observation["tool"][3]
    return np.array([0.56, 0.1 * np.sin(0.2 * k), 0.66, yaw, 0.03])


def digest(env, seed, steps=15):
    """Returns a hash of all observations and rewards of an episode."""
    return "".join(iterate(env, seed, steps))


def iterate(env, seed, steps=15):
    """Yields a hash of the observation and the reward after each step."""
    observation, _ = env.reset(seed=seed)
    for k in range(steps):
        observation, reward, *_ = env.step(sway(observation, k))
        numbers = b"".join(observation[name].tobytes() for name in sorted(observation))
        yield hashlib.sha256(numbers + str(reward).encode()).hexdigest()


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_gymnasium_finds_nothing_wrong():
    env = gymnasium.make("drake_tracker/Train-v0", overrides=[MEASURED])
    check_env(env.unwrapped, skip_render_check=True)


def test_the_environments_are_registered():
    assert {f"drake_tracker/{task}-v0" for task in ("Train", "Ball", "Conveyor")} <= set(gymnasium.registry)


def test_the_same_seed_gives_the_same_episode_beside_another_one(env):
    alone, other = digest(env, 3), make()
    both = [first for first, _ in zip(iterate(env, 3), iterate(other, 4))]
    assert "".join(both) == alone
    assert digest(env, 4) != alone


def test_a_step_is_a_servo_period_and_brings_all_measurements(env):
    first, info = env.reset(seed=1)
    assert (info["privileged"], info["reproducible"], info["busy"]) == (True, True, False)
    seen, previous = list(first["seen"][first["seen"] > 0.0]), first
    for k in range(20):
        observation, *_ = env.step(sway(previous, k))
        assert observation in env.observation_space
        assert observation["time"][0] - previous["time"][0] == pytest.approx(PERIOD)
        seen += list(observation["seen"][observation["seen"] > 0.0])
        previous = observation
    np.testing.assert_allclose(np.diff(seen), 1 / 60, atol=1e-9)


def test_the_hand_follows_a_pose_and_the_jaws_their_opening(env):
    observation, _ = env.reset(seed=1)
    goal = np.array([0.60, 0.05, 0.66, np.pi - 0.1, 0.05])
    for _ in range(40):
        observation, *_ = env.step(goal)
    np.testing.assert_allclose(observation["tool"][:3], goal[:3], atol=2e-3)
    assert np.angle(np.exp(1j * (observation["tool"][3] - goal[3]))) == pytest.approx(0.0, abs=0.01)
    assert observation["jaws"][0] == pytest.approx(0.05, abs=1e-3)


def test_the_hand_follows_a_velocity_and_stands_still_without_an_action():
    env = make(control="velocity")
    start, _ = env.reset(seed=1)
    for _ in range(10):
        observation, *_ = env.step(np.array([0.0, 0.1, 0.0, 0.0, 0.088]))
    assert observation["tool"][1] - start["tool"][1] == pytest.approx(0.03, abs=0.012)
    for _ in range(10):
        env.step(np.zeros(5))
    first = env.step(np.zeros(5))[0]["tool"]
    np.testing.assert_allclose(env.step(None)[0]["tool"], first, atol=1e-4)


def test_no_action_breaks_a_limit(env):
    """A pose out of reach and a pose in the table: the joints stay within their limits, and nothing is touched."""
    env.reset(seed=1)
    model = env._model
    for goal in ([1.0, -1.0, 0.0, 0.0, 0.0], [0.56, 0.0, 0.0, 3.0, 0.0], [9.0, 9.0, 9.0, 9.0, 9.0]):
        for _ in range(25):
            observation, *_ = env.step(np.array(goal))
            q, v = np.split(observation["arm_state"], 2)
            assert (np.abs(v) <= 1.05 * model.velocity_limit).all()
            assert (q >= model.position_lower - 0.01).all() and (q <= model.position_upper + 0.01).all()
    assert not env._loop.read("truth_verdict")[7:].any()


@pytest.mark.parametrize(
    "action, message",
    [
        (np.full(5, np.nan), "must be finite"),
        (np.zeros(4), r"shape \(5,\), not \(4,\)"),
        ("up", "array of numbers, not str"),
        ({"x": 1.0}, "array of numbers, not dict"),
    ],
)
def test_a_wrong_action_is_refused_and_nothing_is_lost(env, action, message):
    observation, _ = env.reset(seed=1)
    with pytest.raises(DrakeTrackerError, match=message):
        env.step(action)
    later, *_ = env.step(None)
    assert later["time"][0] - observation["time"][0] == pytest.approx(PERIOD)


def test_a_step_needs_a_reset(env):
    env.close()
    with pytest.raises(DrakeTrackerError, match="before reset"):
        env.step(None)
    with pytest.raises(DrakeTrackerError, match="before reset"):
        env.render()


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"observe": ("smell",)}, "observe must be one of 'joints'"),
        ({"observe": ("images",)}, "no images to observe"),
        ({"control": "torque"}, "control must be"),
        ({"render_mode": "human"}, "render_mode must be"),
        ({"camera_lag": 0.11}, "6.600 cycles"),
        ({"inference_time": "slow"}, "inference_time must be a time"),
        ({"link_delay": -0.1}, "link_delay must be a time"),
        ({"camera_lag": 3.0}, "vision.lag_cycles"),
    ],
)
def test_wrong_settings_are_refused(settings, message):
    with pytest.raises(DrakeTrackerError, match=message):
        make(**settings)


def test_options_change_the_scenario_but_not_the_observations(env):
    env.reset(seed=1, options={"overrides": ["track.speed=0.2"]})
    assert env.scenario.track.speed == 0.2
    with pytest.raises(DrakeTrackerError, match="observation space"):
        env.reset(seed=1, options={"overrides": [SEVERAL]})


def test_an_episode_is_truncated_at_its_duration_and_shaped_rewards_add_up():
    env = make(shaping=2.0)
    observation, _ = env.reset(seed=1, options={"overrides": ["duration=0.2"]})
    rewards, truncated = [], False
    while not truncated:
        observation, reward, terminated, truncated, info = env.step(np.array([*observation["tool"], 0.088]))
        rewards.append(reward)
    assert not terminated and info["reason"] == "" and observation["time"][0] >= 0.2
    assert 0.0 < abs(sum(rewards)) < 0.2


@pytest.mark.parametrize(
    "name, overrides, ports",
    [
        ("train", [MEASURED], {"point"}),
        ("train:guided", [SEVERAL], {"tracks"}),
        ("train:guided", ["arm.markers=true"], {"tracks", "hand_point"}),
        ("ball", [], {"point"}),
        ("conveyor", [MEASURED, "belt.encoder=true"], {"parts", "encoder"}),
    ],
)
def test_only_sensors_are_observed(name, overrides, ports):
    assert set(point_ports(load_scenario(name, overrides=overrides))) == ports


def test_the_ball_has_a_cup_and_a_shorter_period():
    env = TrackerEnvironment("ball", observe=("joints", "points", "images"))
    assert env.action_space.shape == (4,)
    assert env.observation_space["point"].shape == (1, 6)
    assert env.observation_space["camera"].shape == (1, 256, 256, 3)
    assert env.metadata["render_fps"] == 200


def test_images_have_ages_and_closing_ends_their_processes():
    env = TrackerEnvironment(
        overrides=["cameras.render_processes=1", "vision.lag_cycles=5"],
        observe=("images",),
        render_mode="rgb_array",
    )
    observation, _ = env.reset(seed=1)
    assert (observation["camera_left_age"] == -1.0).all()
    for _ in range(6):
        observation, *_ = env.step(None)
    assert observation in env.observation_space
    ages, images = observation["camera_left_age"], observation["camera_left"]
    assert (ages >= 5 / 60).all() and (ages <= 5 / 60 + PERIOD + 1 / 60).all()
    assert images.shape == (2, 94, 198, 3) and images.std() > 5.0
    assert env.render().shape == (480, 640, 3) and env.render().std() > 5.0
    (system,) = [each for each in env._loop.hand_eye.world.GetSystems() if hasattr(each, "processes")]
    (process,) = system.processes
    env.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


def test_nothing_else_needs_gymnasium_except_one_command():
    package = os.path.dirname(os.path.dirname(drake_tracker.environments.__file__))
    for folder, _, files in os.walk(package):
        for file in files if not folder.endswith("environments") else ():
            if file.endswith(".py") and file != "dataset.py":
                with open(os.path.join(folder, file), encoding="utf-8") as module:
                    text = module.read()
                assert "gymnasium" not in text and "drake_tracker.environments" not in text, file
