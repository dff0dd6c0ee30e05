"""The interface of a policy, and an episode with it."""

from collections.abc import Callable
from typing import Any, Protocol

import gymnasium
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, PartError, raised
from drake_tracker.environments.environment import Observation

Watch = Callable[[Observation, np.ndarray, dict[str, Any]], object]
"""Called with the observation before a step, the last action of the policy, and ``info`` after the step, with
``reward``, ``done`` and ``busy``: whether the policy still computed before the step, so that it was not asked."""


class Policy(Protocol):
    """Turns observations into actions."""

    def reset(self) -> None:
        """Prepares for an episode, after the reset of the environment."""
        ...

    def act(self, observation: Observation) -> np.ndarray:
        """Returns an action for the newest observation, see `TrackerEnvironment`."""
        ...


def run_episode(
    env: gymnasium.Env[Any, Any], policy: Policy, seed: int | None = None, watch: Watch | None = None
) -> dict[str, Any]:
    """Runs an episode. While the policy is busy it is not asked, and the hand goes on with the last action.

    Args:
        env: a `TrackerEnvironment`, perhaps wrapped. After an error it can be reset as usual.
        policy: the policy.
        seed: seed of the episode.
        watch: called after each step.

    Returns a dict with ``success``, ``reason``, ``reproducible``, ``reward``, ``time`` [s] and ``steps``.

    Raises PartError when the policy raises an error or returns something that is no action.
    """
    observation, info = env.reset(seed=seed)
    name, reward, steps, over, last = type(policy).__name__, 0.0, 0, False, None
    try:
        policy.reset()
        while not over:
            action = None if info["busy"] else policy.act(observation)
            if action is None and not info["busy"]:
                raise DrakeTrackerError("act returned None instead of an action")
            before, busy, last = observation, info["busy"], last if action is None else action
            observation, gained, terminated, truncated, info = env.step(action)
            reward, steps, over = reward + float(gained), steps + 1, bool(terminated or truncated)
            if watch is not None:
                watch(before, np.asarray(last), {**info, "busy": busy, "reward": float(gained), "done": over})
    except (Exception, SystemExit) as error:
        text = str(error) if isinstance(error, DrakeTrackerError) else raised(error)
        raise PartError(f"{name}: {text}, at {observation['time'][0]:.3f} s of the episode") from error
    outcome = {key: info[key] for key in ("success", "reason", "reproducible")}
    return {**outcome, "reward": reward, "time": float(observation["time"][0]), "steps": steps}
