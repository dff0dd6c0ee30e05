"""What a policy observes: the measurements of vision since its last action, the joints, the images and their ages."""

import math
from collections import deque
from typing import Any

import numpy as np
from gymnasium import spaces

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import HandPoint, JawState, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.environments.action import flat_pose
from drake_tracker.environments.action_loop import ActionLoop
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.conveyor.diagram import MOST_PARTS
from drake_tracker.tasks.conveyor.setup import resolve as resolve_conveyor
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world.ball.ball_camera import NAME

PARTS = ("joints", "points", "images", "truth")
"""Parts of an observation. ``truth`` is privileged."""


def point_ports(scenario: BaseScenario) -> dict[str, int]:
    """Returns {name of the port: number of elements} of the measurements that the host and the link read."""
    task = task_of(scenario)
    signals, sources = task.signals(), task.replay_sources(scenario, "points")
    ports = {name: len(signals[name][1]) for name in sources if name not in ("status", "diagnosis")}  # of the arm
    sees_hand = isinstance(scenario, TrainScenario) and resolve(scenario).sees_hand
    return {**ports, **({"hand_point": message_size(HandPoint)} if sees_hand else {})}


def image_shapes(scenario: Any) -> dict[str, tuple[int, int, int]]:
    """Returns {name of a fixed camera: (height, width, 3) of its rendered images [px]}, full images for the ball.

    Raises DrakeTrackerError when the scenario has no images.
    """
    if not task_of(scenario).uses_cameras(scenario):
        raise DrakeTrackerError(f"{scenario.where('vision')}: measured vision has no images to observe")
    if scenario.task == "ball":
        return {NAME: (scenario.camera.height, scenario.camera.width, 3)}
    windows = (resolve if scenario.task == "train" else resolve_conveyor)(scenario).windows
    return {f"camera_{side}": (height, width, 3) for side, (_, _, width, height) in windows.items()}


class Measurements:
    """Collects the measurements between two observations.

    Args:
        scenario: the scenario.
        model: the controller's model of the arm.
        parts: parts of the observation, of `PARTS`.
        rows: greatest number of measurements of one port in an observation; of more, the newest are kept.

    Attributes:
        space: the space of the observations.
    """

    def __init__(self, scenario: BaseScenario, model: ArmModel, parts: tuple[str, ...], rows: int) -> None:
        task = task_of(scenario)
        self._model, self._lag, self._truth = model, scenario.lag, task.truth_signal
        self._ports = point_ports(scenario) if "points" in parts else {}
        shapes = image_shapes(scenario) if "images" in parts else {}
        self._cameras = tuple(shapes)
        newest = cycles_in(task.servo_period)
        self._points: deque[tuple[float, dict[str, np.ndarray]]] = deque(maxlen=rows)
        self._delayed: deque[tuple[float, dict[str, np.ndarray]]] = deque()
        self._images: deque[tuple[float, dict[str, np.ndarray]]] = deque(maxlen=newest)

        found: dict[str, spaces.Space[Any]] = {"time": _numbers(1)}
        if "joints" in parts:
            found |= {"arm_state": _numbers(2 * model.num_joints), "tool": _numbers(4)}
            if scenario.task != "ball":
                found["jaws"] = _numbers(message_size(JawState))
        if self._ports:
            found |= {"seen": _numbers(rows), **{name: _numbers(rows, size) for name, size in self._ports.items()}}
        for name, shape in shapes.items():
            found |= {name: spaces.Box(0, 255, (newest, *shape), np.uint8), f"{name}_age": _numbers(newest)}
        if "truth" in parts:
            found["truth"] = _numbers((MOST_PARTS if scenario.task == "conveyor" else 1) * len(BODY_STATE))
        self.space = spaces.Dict(found)

    def clear(self) -> None:
        """Forgets the measurements that the policy has seen. Images remain until newer ones replace them."""
        self._points.clear()

    def sample(self, loop: ActionLoop) -> None:
        """Records the measurements of a cycle."""
        self._points.append((loop.time, {name: loop.read(name) for name in self._ports}))
        captured = loop.time - loop.hand_eye.world.image_latency * VISION_PERIOD
        if self._cameras and captured > 0.0:
            self._delayed.append((captured, {name: loop.read(name)[:, :, :3] for name in self._cameras}))
        while self._delayed and self._delayed[0][0] <= loop.time - self._lag + 0.5 * VISION_PERIOD:
            self._images.append(self._delayed.popleft())

    def observation(self, loop: ActionLoop) -> dict[str, np.ndarray]:
        """Returns the observation at the present time. Rows without a measurement are zero, and their ages are -1."""
        now = loop.time
        values: dict[str, Any] = {"time": [now], "seen": [seen for seen, _ in self._points]}
        values |= {name: [rows[name] for _, rows in self._points] for name in self._ports}
        for name in self._cameras:
            values[name] = [images[name] for _, images in self._images]
            values[f"{name}_age"] = [now - captured for captured, _ in self._images]
        for name, port in (("arm_state", "arm_state"), ("jaws", "jaws"), ("truth", self._truth)):
            if name in self.space.spaces:
                values[name] = loop.read(port)
        if "tool" in self.space.spaces:
            values["tool"] = flat_pose(self._model.tool_pose(values["arm_state"][: self._model.num_joints]))
        found = {}
        for name, box in self.space.items():
            array = np.full(box.shape or (), -1.0 if name.endswith("_age") else 0.0, box.dtype)
            if len(values[name]):
                array[: len(values[name])] = values[name]
            found[name] = array
        return found


def cycles_in(time: float) -> int:
    """Returns how many vision cycles can end within a time [s], at most."""
    return math.ceil(time / VISION_PERIOD - 1e-9)


def _numbers(*shape: int) -> spaces.Box:
    return spaces.Box(-np.inf, np.inf, shape, np.float64)
