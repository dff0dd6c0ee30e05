"""Where exactly known cameras see a point."""

import numpy as np
import pytest

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import Centroid, TrackPoint
from drake_tracker.report.failure_diagnosis.reference_estimate import seen_by
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.setup import resolve

P_WQ = np.array([0.56, 0.05, 0.48])
STAMPS = np.array([1.0])


@pytest.mark.parametrize(
    "gap, several, stays", [(0.001, False, False), (0.0, False, False), (0.001, True, False), (0.0, True, True)]
)
def test_a_point_that_the_tracker_found_without_rays_stays_where_it_is(gap, several, stays):
    cameras = resolve(load_scenario("train:learned")).cameras
    log = {"point": Signal(STAMPS, np.array([[1.0, *(P_WQ + 0.01), gap, 1.0]]), tuple(TrackPoint.get_fields()))}
    for side, camera in cameras.items():
        row = [1.0, *camera.project(P_WQ)[0], 50.0, 1.0]
        log[f"centroid_{side}"] = Signal(STAMPS, np.array([row]), tuple(Centroid.get_fields()))
    if several:
        log["tracks"] = log["point"]
    (seen,) = seen_by((cameras["left"], cameras["right"]), log, STAMPS, P_WQ[None] + 0.01)
    assert seen == pytest.approx(P_WQ + 0.01 if stays else P_WQ, abs=1e-6)
