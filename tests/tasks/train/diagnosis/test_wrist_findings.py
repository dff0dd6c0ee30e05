import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import WristPoint
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import wrist_findings
from drake_tracker.tasks.train.two_processes import resolve_split
from drake_tracker.tasks.train.vision import make_vision
from drake_tracker.vision.hand.wrist_measurement import WristReason

SPANS = [PhaseSpan(Phase.TRACK, 0.0, 1.0), PhaseSpan(Phase.INTERCEPT, 1.0, 2.0), PhaseSpan(Phase.LIFT, 2.0, 3.0)]


def log_of(rows):
    """A log with rows of (stamp, source, reason)."""
    names = tuple(WristPoint.get_fields())
    data = np.zeros((len(rows), len(names)))
    for row, (stamp, source, reason) in zip(data, rows):
        row[names.index("stamp")], row[names.index("source")], row[names.index("reason")] = stamp, source, reason
    return {"wrist": Signal(np.arange(float(len(rows))), data, names)}


def test_shares_of_the_sources_in_hover_and_descent():
    unknown = WristReason.NOT_LEARNED
    log = log_of(
        [(0.2, 1, unknown), (0.4, 3, 0), (0.4, 3, 0), (1.2, 3, 0), (1.4, 2, 0), (1.6, 2, 0), (1.8, 2, 0), (2.5, 0, 9)]
    )
    found = wrist_findings(log, SPANS)
    assert found["hover"] == {"fixed": 0.5, "both": 0.5}
    assert found["descent"] == {"wrist": 0.75, "both": 0.25}
    assert found["reasons"] == {"VALID": pytest.approx(5 / 6), "NOT_LEARNED": pytest.approx(1 / 6)}


def test_no_images_give_no_shares():
    assert wrist_findings(log_of([]), SPANS) == {"hover": None, "descent": None, "reasons": None}


def test_a_camera_on_the_hand_needs_the_fixed_ones_to_track_objects():
    for override in ("vision.method=!MotionCentroid {}", "vision=!Measured {}"):
        with pytest.raises(DrakeTrackerError, match=r"cameras.wrist.*!SilhouetteTracker"):
            load_scenario("train:wrist", overrides=[override])


def test_a_camera_at_another_place_needs_a_calibration_of_its_own():
    with pytest.raises(DrakeTrackerError, match=r"train_wrist.yaml.*tilt_deg"):
        make_vision(resolve(load_scenario("train:wrist", overrides=["cameras.wrist.tilt_deg=20.0"])))


def test_two_processes_have_no_camera_on_the_hand():
    with pytest.raises(DrakeTrackerError, match="cameras.wrist"):
        resolve_split(load_scenario("train:wrist"))
