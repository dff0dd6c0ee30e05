"""The controller of a scenario as a policy: host, link and arm, simulated beside the environment."""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import ArmCommand, ToolStatus
from drake_tracker.core.timing import LIMITER_SLOT
from drake_tracker.diagrams.hand_eye import inputs
from drake_tracker.diagrams.parts import make_host
from drake_tracker.environments.action_loop import STEP_SLOT
from drake_tracker.environments.environment import Observation, TrackerEnvironment
from drake_tracker.estimation.estimator import Estimator

AFTER_TICK = 0.5 * (LIMITER_SLOT + 1.0) - STEP_SLOT
"""Fraction of a plant step from an observation until all Systems of the arm have been updated."""


class ControllerPolicy:
    """The controller of the environment's scenario, perhaps with other settings or another estimator.

    Its action is the pose that its transform equation asks for, and the opening of the jaws. Without latency the hand
    moves as with the scenario's own diagram. Only the environment has a collision reflex.

    Args:
        env: the environment, with pose control. It gives the scenario.
        settings: {key path: value} of the controller that differ from the scenario.
        estimator: makes the estimator that replaces the scenario's; None: the host of the scenario.
        truth: whether this estimator gets the true position without lag, in place of the points.

    Raises DrakeTrackerError when the environment does not observe what the controller reads.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        settings: Mapping[str, Any] = MappingProxyType({}),
        estimator: Callable[[], Estimator[Any]] | None = None,
        truth: bool = False,
    ) -> None:
        if not isinstance(env.unwrapped, TrackerEnvironment):
            raise DrakeTrackerError(f"{type(env.unwrapped).__name__} is no environment of this package")
        self._env, self._settings, self._estimator, self._truth = env.unwrapped, settings, estimator, truth
        self._observed = set(self._env.observation_space.spaces)
        if {"truth" if truth else "seen", "arm_state"} - self._observed:
            raise DrakeTrackerError(f"the policy must observe joints and {'truth' if truth else 'points'}")

    def reset(self) -> None:
        """Builds the controller of the present episode."""
        env, builder = self._env, DiagramBuilder()
        scenario = env.scenario.with_settings(self._settings)
        host = None
        if self._estimator is not None:
            several = "tracks" in self._observed and not self._truth
            host = make_host(self._estimator(), scenario.time_step, several=several)
        host, link, self._arm = env.task.add_controller(scenario, env.initialisation, builder, host)
        self._simulator = Simulator(builder.Build())
        self._context, self._after = self._simulator.get_mutable_context(), AFTER_TICK * scenario.time_step
        self._ports = []
        for system in (host, link, self._arm):
            context = system.GetMyMutableContextFromRoot(self._context)
            for port in inputs(system):
                if port.get_name() in self._observed | {"point"} and not port.HasValue(context):
                    port.FixValue(context, np.zeros(port.size()))
                    self._ports.append((port.get_name(), port, context))

    def act(self, observation: Observation) -> np.ndarray:
        """Returns the action for the servo period that begins now."""
        now, state = float(observation["time"][0]), ("arm_state", "jaws")
        for row, seen in enumerate(() if self._truth else observation["seen"]):
            if seen > self._context.get_time():
                self._simulator.AdvanceTo(seen)
                self._fix({name: observation[name][row] for name, _, _ in self._ports if name not in state})
        self._simulator.AdvanceTo(now)
        self._fix({name: observation[name] for name in state if name in observation})
        if self._truth:
            self._fix({"point": np.array([now, *observation["truth"][4:7], 0.0, 1.0])})  # a TrackPoint
        self._simulator.AdvanceTo(now + self._after)
        context = self._arm.GetMyContextFromRoot(self._context)
        tool = ToolStatus(self._arm.GetOutputPort("status").Eval(context))
        width = ArmCommand(self._arm.GetOutputPort("command").Eval(context)).jaw_width
        yaw = math.remainder(tool.yaw, 2.0 * math.pi)
        return np.array([tool.x, tool.y, tool.z, yaw, *([width] if "jaws" in self._observed else [])])

    def _fix(self, values: Mapping[str, np.ndarray]) -> None:
        for name, port, context in self._ports:
            if name in values:
                port.FixValue(context, values[name])
