"""The faults that `autopsy.py` injects: settings of the scenario, or parts that replace the scenario's."""

import contextlib
from dataclasses import dataclass, replace
from typing import Any
from unittest import mock

import numpy as np

from drake_tracker.arm.motion import servo_system
from drake_tracker.arm.motion.servo import Servo
from drake_tracker.report.failure_diagnosis.stages import Stage
from drake_tracker.tasks.train import diagram as train
from drake_tracker.tasks.train import setup, vision
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram

MEASURED = "vision=!Measured {}"


class ShiftedDetector:
    """A motion detector whose centroid is shifted by ``shift`` [px] to the right, as by a second moving object."""

    def __init__(self, detector, shift):
        self._detector, self._shift = detector, shift

    def __getattr__(self, name):
        return getattr(self._detector, name)

    def centroid(self, mask):
        region = self._detector.centroid(mask)
        return None if region is None else region._replace(u=region.u + self._shift)


def shifted_vision(shift):
    """Replaces `VisionDiagram` by one whose left camera's centroids are shifted by ``shift`` [px]."""

    def make(cameras, detectors, **settings):
        return VisionDiagram(cameras, detectors | {"left": ShiftedDetector(detectors["left"], shift)}, **settings)

    return mock.patch.object(vision, "VisionDiagram", make)


@contextlib.contextmanager
def turned_camera(angle):
    """Rotates the right camera's calibration by ``angle`` [rad] about the vertical axis through the camera."""
    whole = setup.calibrated_with

    def load(faults, calibrated):
        cameras = whole(faults, calibrated)
        right = cameras["right"]
        cos, sin = np.cos(angle), np.sin(angle)
        X_WC = right.X_WC
        X_WC[:3, :3] = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ X_WC[:3, :3]
        return cameras | {"right": replace(right, X_CW=np.linalg.inv(X_WC))}

    with mock.patch.object(setup, "calibrated_with", load):
        yield


@dataclass(frozen=True)
class SmoothedState:
    """The state of an estimator and of the low-pass filter before it."""

    inner: Any
    point: Any = None
    before: float = -np.inf

    @property
    def stamp(self):
        return self.inner.stamp

    def __deepcopy__(self, memo):
        return self


class Wrapped:
    """An estimator that forwards everything to another one."""

    def __init__(self, inner, size):
        self._inner, self._size = inner, size

    def __getattr__(self, name):
        return getattr(self._inner, name)


class Smoothed(Wrapped):
    """An estimator behind a low-pass filter with a time constant of ``size`` [s], which delays the points."""

    def initial_state(self):
        return SmoothedState(self._inner.initial_state())

    def update(self, state, stamp, p_WQ):
        if p_WQ is not None and stamp > state.before:
            gap = stamp - state.before
            share = 1.0 if state.point is None or gap > 0.3 else 1.0 - np.exp(-gap / self._size)
            last = p_WQ if state.point is None else state.point
            p_WQ = last + share * (np.asarray(p_WQ) - last)
        inner = self._inner.update(state.inner, stamp, p_WQ)
        return state if inner is state.inner else SmoothedState(inner, p_WQ, stamp)

    def ready(self, state):
        return self._inner.ready(state.inner)

    def predict(self, state, times):
        return self._inner.predict(state.inner, times)

    def predict_std(self, state, times):
        return self._inner.predict_std(state.inner, times)


class Straightened(Wrapped):
    """An estimator whose prediction is a weighted mean with constant velocity, weight ``size``."""

    def predict(self, state, times):
        path = self._inner.predict(state, times)
        step = 0.02
        here, there = self._inner.predict(state, np.array([state.stamp, state.stamp + step]))
        straight = here + np.outer(np.asarray(times) - state.stamp, (there - here) / step)
        straight[:, 3] = here[3]
        return (1.0 - self._size) * path + self._size * straight


def wrapped_estimator(kind, size):
    whole = train.estimator_of
    return mock.patch.object(train, "estimator_of", lambda *settings: kind(whole(*settings), size))


def late_servo(lag):
    """Replaces `Servo` by one that reads each packet ``lag`` [s] before the time at which its set-point is due."""

    class LateServo(Servo):
        def __init__(self, *settings, lead, **options):
            super().__init__(*settings, lead=lead - lag, **options)

    return mock.patch.object(servo_system, "Servo", LateServo)


@dataclass(frozen=True)
class Fault:
    """A fault to inject.

    Attributes:
        stage: the stage that the autopsy should name; None without a fault.
        size: the size of the fault, in the unit that `autopsy_tables` names.
        overrides: a function of the size that returns settings of the scenario.
        part: a function of the size that returns a context in which a part is replaced.
    """

    stage: Stage | None
    size: float
    overrides: Any = lambda size: [MEASURED]
    part: Any = lambda size: contextlib.nullcontext()


FAULTS = {
    "vision": Fault(Stage.VISION, 16.0, lambda size: [], shifted_vision),
    "triangulation": Fault(Stage.TRIANGULATION, 0.02, lambda size: [], turned_camera),
    "filter": Fault(Stage.FILTER, 0.42, part=lambda size: wrapped_estimator(Smoothed, size)),
    "prediction": Fault(Stage.PREDICTION, 0.62, part=lambda size: wrapped_estimator(Straightened, size)),
    "link": Fault(
        Stage.LINK,
        0.77,
        lambda size: [MEASURED, f"link=!Lossy {{drop: {size}, burst: 30}}"],
    ),
    "servo": Fault(Stage.SERVO, 0.39, part=late_servo),
    "timing": Fault(Stage.TIMING, 0.24, lambda size: [MEASURED, f"grasp.closing_lead={size}"]),
    "none": Fault(None, 0.0),
    "none-rendered": Fault(None, 0.0, lambda size: []),
}
