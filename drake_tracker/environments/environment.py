"""The Gymnasium environment: a policy moves the hand of a scenario, and latency passes in simulated time."""

import math
import time
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.environments.action import POSE, VELOCITY
from drake_tracker.environments.action_loop import ActionLoop
from drake_tracker.environments.latency import WALL_TIME, WITH_ACTION, ActionLine, InferenceTime, check_time, lag_cycles
from drake_tracker.environments.measurements import PARTS, Measurements, cycles_in
from drake_tracker.tasks.loader import load_scenario, validate
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.task import BODY_STATE

Observation = dict[str, np.ndarray]
"""{name: array}, see `TrackerEnvironment`."""
LOWEST, HIGHEST = np.array([-1.0, -1.0, 0.0, -np.pi]), np.array([1.0, 1.0, 1.5, np.pi])
"""Limits of a pose (x, y, z, yaw) in W of the tool [m, rad]: a box around the reach of every packaged arm."""
FASTEST = np.array([1.0, 1.0, 1.0, np.pi])
"""Largest velocity of the tool [m/s, rad/s]; chosen."""
LONGEST_THINKING = 1.0
"""Inference time up to which measurements are kept if it is not constant [s]; chosen."""
SCORES = {"train": "taken", "ball": "caught", "conveyor": "placed"}
"""{task: field of the verdict that counts the successes}."""


class TrackerEnvironment(gymnasium.Env[Observation, np.ndarray]):
    """An environment in which the arm follows actions. A step advances the world by one servo period.

    An observation is a dict of float64 arrays, with images as uint8:

    - ``time`` (1,): simulated time [s].
    - Part ``joints``: ``arm_state`` (2 n,), measured joint positions and velocities [rad, rad/s]; ``tool`` (4,), the
      measured pose (x, y, z, yaw) in W of the tool [m, rad]; ``jaws``, a `JawState`.
    - Part ``points``: the messages of vision since the last accepted action, one row per cycle: ``point`` (rows,
      `TrackPoint`), ``tracks``, ``parts`` or ``encoder``; ``seen`` (rows,): when a row appeared [s], 0 if it is unused.
    - Part ``images``: the newest images of each camera (rows, height, width, 3), RGB; NAME_age (rows,): their ages [s],
      -1 if there is none.
    - Part ``truth``: the true states of the objects in W, `BODY_STATE` each. It sets ``info["privileged"]``.

    An action is the pose (x, y, z, yaw) in W of the tool [m, rad] or, with ``control="velocity"``, its rates; then the
    opening of the jaws [m] if there are jaws; then the inference time [s] with ``inference_time="action"``. Actions
    outside of the space are clipped. None keeps the last action.

    The reward is the number of new successes according to the judge: trains lifted, balls caught, parts placed.
    ``info`` has ``busy`` (the policy still computes, and the next action will be refused), ``refused``, ``success``,
    ``reason`` (why the episode has ended, "" before), ``privileged`` and ``reproducible``.

    Args:
        scenario: name or file of the scenario.
        overrides: settings that replace the scenario's, each "key.path=value".
        camera_lag: time from the capture of an image until its content is observed [s], a multiple of 1/60 s; None:
            that of the scenario.
        inference_time: time that the policy needs for an action [s]: a constant, a function that draws it from a
            generator, "action", or "wall" for the measured wall time, which cannot be reproduced.
        link_delay: time from the end of the computation until the arm has the action [s].
        pipelined: whether the policy takes a new request while it computes.
        control: "pose" or "velocity".
        observe: parts of the observation.
        shaping: reward per metre that the tool comes nearer to the nearest object; it rests on the truth [1/m].
        render_mode: "rgb_array" or None.
        initialisation: result of the task's initialisation for all episodes; None: each episode initialises its task.
        allow_code: whether code that the scenario file names may run, see `load_scenario`.

    Raises DrakeTrackerError when an argument is wrong.
    """

    action_space: spaces.Box
    observation_space: spaces.Dict
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012

    def __init__(
        self,
        scenario: str = "train",
        overrides: Sequence[str] = (),
        *,
        camera_lag: float | None = None,
        inference_time: InferenceTime = 0.0,
        link_delay: float = 0.0,
        pipelined: bool = False,
        control: str = "pose",
        observe: Sequence[str] = ("joints", "points"),
        shaping: float = 0.0,
        render_mode: str | None = None,
        initialisation: Any = None,
        allow_code: bool | None = None,
    ) -> None:
        choices = [("control", control, ("pose", "velocity")), ("render_mode", render_mode, (None, "rgb_array"))]
        for name, value, allowed in [*choices, *(("observe", part, PARTS) for part in observe)]:
            if value not in allowed:
                raise DrakeTrackerError(f"{name} must be one of {', '.join(map(repr, allowed))}, not {value!r}")
        if not (callable(inference_time) or inference_time in (WITH_ACTION, WALL_TIME)):
            inference_time = check_time("inference_time", inference_time)
        self._name, self._overrides, self._allow_code = scenario, tuple(overrides), allow_code
        self._lag = None if camera_lag is None else lag_cycles(camera_lag)
        self._inference_time = inference_time
        self._link_delay, self._pipelined = check_time("link_delay", link_delay), pipelined
        self._mode = VELOCITY if control == "velocity" else POSE
        self._parts, self._shaping = tuple(observe), shaping
        self.render_mode, self._given = render_mode, initialisation
        self._loop: ActionLoop | None = None
        self.initialisation = initialisation
        self.scenario = self._load(0)
        self.task = task_of(self.scenario)
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.task.servo_period)}
        self._jaws: Any = getattr(self.scenario, "grasp", None) or getattr(self.scenario, "pick", None)
        self._model = make_arm_model(arm_of(self.scenario))
        self._measurements = self._make_measurements()
        self.observation_space = self._measurements.space
        low, high = (-FASTEST, FASTEST) if self._mode == VELOCITY else (LOWEST, HIGHEST)
        more = [self._jaws.jaw_opening] if self._jaws else []
        more += [LONGEST_THINKING] if inference_time == WITH_ACTION else []
        limits = np.array([*low, *np.zeros(len(more))]), np.array([*high, *more])
        self.action_space = spaces.Box(*limits, dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, Any]:
        """Begins an episode, and returns the first observation and ``info``.

        Args:
            seed: seed of the scenario and of the inference times; None draws it.
            options: {"overrides": further settings}. They must not change the shapes of the observation.

        Raises DrakeTrackerError when the scenario cannot be built.
        """
        super().reset(seed=seed)
        self.close()
        drawn = int(self.np_random.integers(2**31)) if seed is None else seed
        self.scenario = self._load(drawn, (options or {}).get("overrides", ()))
        self._measurements = self._make_measurements()
        if self._measurements.space != self.observation_space:
            raise DrakeTrackerError("options: the overrides change the observation space; make another environment")
        self.initialisation = self.task.initialise(self.scenario) if self._given is None else self._given
        pictures = self.render_mode is not None
        self._loop = ActionLoop(self.scenario, self.initialisation, self._model, self._jaws, pictures)
        self._line = ActionLine(self._link_delay, self._pipelined, np.zeros(6))
        self._score, self._distance = 0.0, 0.0
        observation, _, info = self._advance(self._loop)
        return observation, info

    def step(self, action: np.ndarray | None) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advances the world by one servo period.

        Args:
            action: see `TrackerEnvironment`.

        Raises DrakeTrackerError when the action has another shape or is not finite, which changes nothing, when there
        was no `reset`, or when the simulation fails, which ends the episode.
        """
        if self._loop is None:
            raise DrakeTrackerError("step was called before reset")
        now, refused = self._loop.time, False
        if action is not None:
            checked, wall_time, refused = self._checked(action), time.monotonic() - self._asked, self._line.busy(now)
            if not refused:
                thinking = self._thinking_time(checked, wall_time)
                width = checked[4] if self._jaws else 0.0
                self._line.request(now, thinking, np.array([*checked[:4], width, self._mode]))
                self._measurements.clear()
        observation, reward, info = self._advance(self._loop)
        info["refused"] = refused
        return observation, reward, bool(info["reason"]), self._loop.time >= self.scenario.duration, info

    def render(self) -> Any:
        """Returns a picture of the laboratory, shape (480, 640, 3), RGB; None without a render mode."""
        if self._loop is None:
            raise DrakeTrackerError("render was called before reset")
        return None if self.render_mode is None else self._loop.picture()

    def close(self) -> None:
        """Ends the episode and its processes."""
        if self._loop is not None:
            self._loop.hand_eye.world.close()
            self._loop = None

    def _load(self, seed: int, overrides: Sequence[str] = ()) -> Any:
        every = (*self._overrides, *overrides)
        scenario = load_scenario(self._name, seed=seed, overrides=every, allow_code=self._allow_code)
        if self._lag is not None:
            scenario = scenario.with_settings({scenario.LAG_KEY: self._lag})
            validate(scenario)
        if "images" in self._parts and scenario.task == "ball":  # its window differs from seed to seed
            scenario = scenario.with_settings({"camera.render_window": False})
        return scenario

    def _make_measurements(self) -> Measurements:
        period, thinking = self.task.servo_period, self._inference_time
        longest = thinking if isinstance(thinking, float) else LONGEST_THINKING
        steps = 1 if self._pipelined else max(1, math.ceil(longest / period - 1e-9))
        return Measurements(self.scenario, self._model, self._parts, rows=cycles_in(steps * period))

    def _advance(self, loop: ActionLoop) -> tuple[Observation, float, dict[str, Any]]:
        """Returns observation, reward and ``info`` after a servo period."""
        try:
            loop.advance(self._line.in_effect(loop.time), self._measurements.sample)
        except BaseException:
            self.close()
            raise
        observation = self._measurements.observation(loop)
        verdict = self.task.verdict(loop.read("truth_verdict"))
        score, distance = float(getattr(verdict, SCORES[self.task.name])), 0.0
        if self._shaping:
            p_WT = self._model.tool_pose(loop.read("arm_state")[: self._model.num_joints]).translation()
            bodies = loop.read(self.task.truth_signal).reshape(-1, len(BODY_STATE))
            distance = float(np.min(np.linalg.norm(bodies[:, 4:7] - p_WT, axis=1)))
        reward = score - self._score + self._shaping * (self._distance - distance)
        self._score, self._distance = score, distance
        info = {
            "busy": self._line.busy(loop.time),
            "refused": False,
            "success": score > 0.0,
            "reason": self.task.ended(verdict) or "",
            "privileged": "truth" in self._parts,
            "reproducible": self._inference_time != WALL_TIME,
        }
        self._asked = time.monotonic()
        return observation, reward, info

    def _checked(self, action: Any) -> np.ndarray:
        """Returns an action inside of the space. Raises DrakeTrackerError when it is none."""
        try:
            array = np.asarray(action, dtype=float)
        except (TypeError, ValueError):
            raise DrakeTrackerError(f"an action must be an array of numbers, not {type(action).__name__}") from None
        if array.shape != self.action_space.shape:
            raise DrakeTrackerError(f"an action must have the shape {self.action_space.shape}, not {array.shape}")
        if not np.isfinite(array).all():
            raise DrakeTrackerError(f"an action must be finite, not {array.tolist()}")
        return np.clip(array, self.action_space.low, self.action_space.high)

    def _thinking_time(self, action: np.ndarray, wall_time: float) -> float:
        """Returns the inference time of an action [s]."""
        if callable(self._inference_time):
            return check_time("inference_time()", self._inference_time(self.np_random))
        if self._inference_time == WALL_TIME:
            return wall_time
        return float(action[-1] if self._inference_time == WITH_ACTION else self._inference_time)
