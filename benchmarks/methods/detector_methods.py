"""The methods that `ball_detectors.py` compares: the package's detectors and OpenCV's, behind one interface."""

import cv2

from drake_tracker.vision.centroid.background_difference import BackgroundDifferenceDetector
from drake_tracker.vision.centroid.config import BackgroundDifference, FrameDifference, NormalFlow, StaticThreshold
from drake_tracker.vision.centroid.frame_difference import FrameDifferenceDetector
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.centroid.static_threshold import StaticThresholdDetector
from drake_tracker.vision.region_centroid import hull_centroid

FLOW_THRESHOLD = 0.45
"""Displacement [px] between consecutive images above which a pixel of the dense flow moves."""


class Detector:
    """A detector of the package: smoothing, buffered images, mask, centroid."""

    def __init__(self, detector):
        self.detector, self._buffer = detector, ()
        self.delay = detector.stamp_age_cycles

    def __call__(self, grey):
        self._buffer = (self._buffer + (self.detector.smooth(grey),))[-self.detector.buffer_length :]
        described = self.described
        return described and self.detector.centroid(self.detector.mask(*described))

    @property
    def described(self):
        """The smoothed images from which the newest centroid is computed, or None while there are too few."""
        full = len(self._buffer) == self.detector.buffer_length
        return self._buffer[:: self.detector.stride] if full else None


class Subtractor:
    """A background subtractor of OpenCV, trained on the empty scene."""

    delay = 0

    def __init__(self, model, scene):
        self._model, self._scene = model, scene
        for image in scene.lessons:
            model.apply(image)

    def __call__(self, grey):
        return self._scene.centroid(self._model.apply(grey))


class DenseFlow:
    """DIS optical flow, ultrafast preset: the region that moves."""

    delay = 0.5

    def __init__(self, scene):
        self._dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._last, self._scene = None, scene

    def __call__(self, grey):
        last, self._last = self._last, grey
        if last is None:
            return None
        flow = self._dis.calc(last, grey, None)
        return self._scene.centroid(cv2.compare(cv2.magnitude(flow[..., 0], flow[..., 1]), FLOW_THRESHOLD, cv2.CMP_GT))


class Scene:
    """What a method knows before the object moves: static image, images of the empty scene, window, join distance."""

    def __init__(self, static, lessons, window, join_distance):
        self.static, self.lessons, self.window, self.join_distance = static, lessons, window, join_distance

    def centroid(self, mask):
        """Returns the centroid of another library's mask, computed as the package's detectors do."""
        region = hull_centroid(cv2.bitwise_and(mask, self.window), self.join_distance)
        return region if region is not None and region.pixel_count >= 6 else None


DEFAULT = "frame difference"
"""The scenario's default, with gain normalisation."""
WITHOUT_GAIN = "frame difference, gain not normalised"
AS_THE_PAPER = "frame difference, mean as in the paper, gain not normalised"
FLOW_LITERAL = "normal flow, paper literal"
FLOW_TRAIN = "normal flow, as for the train"
FLOW_TRAIN_MEAN = "normal flow, as for the train, mean"
FLOW_BALL = "normal flow, set for the ball"
BACKGROUND, STATIC = "background difference", "static threshold"
MOG2, KNN, DIS = "MOG2 (OpenCV)", "KNN (OpenCV)", "DIS flow (OpenCV)"
EVERY_IMAGE = "frame difference, every image"
BALL_FLOW = {"stride": 1, "smoothing_size": 3, "min_pixels": 6, "join_distance": 12}
"""Changes to the preset ``scaled``: the resolution of the ball's detectors, on consecutive images."""


def methods(join_distance):
    """Returns {name: constructor of a method from a `Scene`}, with the hull's join distance of the task."""

    def difference(**settings):
        settings = {"join_distance": join_distance, **settings}
        return lambda scene: Detector(FrameDifferenceDetector(FrameDifference(**settings), window=scene.window))

    def flow(preset, **settings):
        return lambda scene: Detector(NormalFlowDetector(NormalFlow(preset, **settings), window=scene.window))

    def background(scene):
        settings = BackgroundDifference(join_distance=join_distance, threshold=6.0)
        return Detector(BackgroundDifferenceDetector(settings, image=scene.static, window=scene.window))

    def threshold(scene):
        settings = StaticThreshold(join_distance=join_distance)
        return Detector(StaticThresholdDetector(settings, window=scene.window))

    return {
        DEFAULT: difference(),
        WITHOUT_GAIN: difference(normalise_gain=False),
        AS_THE_PAPER: difference(centroid="mean", normalise_gain=False),
        EVERY_IMAGE: difference(stride=1),
        f"{EVERY_IMAGE}, gain not normalised": difference(stride=1, normalise_gain=False),
        BACKGROUND: background,
        STATIC: threshold,
        FLOW_LITERAL: flow("paper_literal", centroid="mean"),
        FLOW_TRAIN: flow("scaled"),
        FLOW_BALL: flow("scaled", **BALL_FLOW),
        MOG2: lambda scene: Subtractor(cv2.createBackgroundSubtractorMOG2(detectShadows=False), scene),
        KNN: lambda scene: Subtractor(cv2.createBackgroundSubtractorKNN(detectShadows=False), scene),
        DIS: DenseFlow,
    }


def sparser(join_distance):
    """Returns {(name, stride): constructor}: flow and difference on every image, every second and every fourth."""
    made = {}
    for stride in (1, 2, 4):
        flows = {FLOW_LITERAL: NormalFlow("paper_literal", centroid="mean", stride=stride),
                 FLOW_BALL: NormalFlow(**{**BALL_FLOW, "stride": stride})}  # fmt: skip
        for name, flow in flows.items():
            made[name, stride] = lambda scene, flow=flow: Detector(NormalFlowDetector(flow, window=scene.window))
        difference = FrameDifference(stride=stride, join_distance=join_distance)
        made[DEFAULT, stride] = lambda scene, p=difference: Detector(FrameDifferenceDetector(p, window=scene.window))
    return made
