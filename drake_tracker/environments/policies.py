"""The built-in policies by name, and the estimators of those that predict less than the package can."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.environments.controller_policy import ControllerPolicy
from drake_tracker.estimation.alpha_beta_gamma import AlphaBetaGammaEstimator, CartesianState
from drake_tracker.estimation.config import ArcLength, ClosedPath
from drake_tracker.estimation.coordinated_turn import CoordinatedTurnEstimator

GUIDED = {"grasp.descent": "guided", "grasp.gate": "probability", "grasp.lift_height": 0.18}
"""Settings of the guided grasp, as in the scenario ``train:guided``."""
POLICIES = ("1991", "guided", "straight_line", "last_point", "truth")
"""Names of the built-in policies."""


class StraightLine(AlphaBetaGammaEstimator):
    """An `Estimator` that extrapolates the present position at the present velocity."""

    def predict(self, state: CartesianState, times: ArrayLike) -> np.ndarray:
        now, soon = super().predict(state, [state.stamp, state.stamp + 1e-3])
        return now + np.outer(np.asarray(times) - state.stamp, [*(soon - now)[:3] / 1e-3, 0.0])


class LastSeen(AlphaBetaGammaEstimator):
    """An `Estimator` that predicts that the object stays where it was seen last."""

    def predict(self, state: CartesianState, times: ArrayLike) -> np.ndarray:
        return np.tile(super().predict(state, [state.stamp]), (len(np.asarray(times)), 1))


def make_policy(name: str, env: gymnasium.Env[Any, Any]) -> ControllerPolicy:
    """Returns a built-in policy.

    - ``1991``: the estimator and the blind descent of Allen et al. 1991. For the ball and the conveyor, the controller
      of the scenario.
    - ``guided``: the filter that learns the closed path, and the guided descent. Only for the train.
    - ``straight_line``, ``last_point``: a guided descent without a gate on these predictions. Not for the conveyor.
    - ``truth``: the same on the true position without lag, with a filter of coordinated turns. It needs the privileged
      part of the observation.

    Args:
        name: one of `POLICIES`.
        env: the environment, see `ControllerPolicy`.

    Raises DrakeTrackerError when there is no such policy for this environment.
    """
    task = env.unwrapped.scenario.task if hasattr(env.unwrapped, "scenario") else ""
    if name == "1991":
        classic = {"estimator": ArcLength(), "grasp.descent": "blind", "grasp.gate": "auto"}
        return ControllerPolicy(env, classic if task == "train" else {})
    if name == "guided" and task == "train":
        return ControllerPolicy(env, {"estimator": ClosedPath(), **GUIDED})
    estimators = {"straight_line": StraightLine, "last_point": LastSeen, "truth": CoordinatedTurnEstimator}
    if name not in estimators or task == "conveyor":
        raise DrakeTrackerError(f"there is no policy {name!r} for the {task}; the names are {', '.join(POLICIES)}")
    eager = {**GUIDED, "grasp.launch_probability": 0.0}  # the hand descends as soon as it is above the object
    return ControllerPolicy(env, eager if task == "train" else {}, estimators[name], truth=name == "truth")
