import copy

import numpy as np
import pytest
from ball_pictures import BALL_RADIUS, INCLINE, LENGTH, SIZE, WIDTH, board_pose, camera_pose, intrinsics
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_tracker.core.messages import Centroid, TrackPoint, message_size
from drake_tracker.core.timing import ESTIMATOR_SLOT, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.vision.centroid.plane_projection import PlausiblePoints, camera_on_board
from drake_tracker.vision.centroid.plane_projector_system import PlaneProjectorSystem

CAMERA = camera_on_board(intrinsics(), camera_pose(), SIZE, SIZE)
LAG = 5 * VISION_PERIOD


def path(stamp):
    """p_BQ [m] of a ball that runs down the board, except for one outlier."""
    outlier = 10.5 < stamp / VISION_PERIOD < 11.5
    return np.array([-0.25 if outlier else 0.1, 0.8 - 0.5 * stamp, BALL_RADIUS])


class Centroids(LeafSystem):
    """A centroid in every cycle, `LAG` after its stamp; none is valid before 0.05 s or in the cycles ``blind``."""

    def __init__(self, blind=()):
        super().__init__()
        self._blind = blind
        self.DeclareVectorOutputPort("centroid", message_size(Centroid), self._calc)

    def _calc(self, context, output):
        cycle = np.floor(context.get_time() / VISION_PERIOD + 1e-6) - LAG / VISION_PERIOD
        if cycle < 0:
            return output.SetFromVector(np.zeros(message_size(Centroid)))
        stamp = cycle * VISION_PERIOD
        u, v = CAMERA.project(path(stamp))[0]
        valid = float(stamp > 0.05 and cycle not in self._blind)
        return output.SetFromVector([stamp, u, v, 30.0, valid])


def make():
    return PlaneProjectorSystem(CAMERA, board_pose(), BALL_RADIUS, PlausiblePoints(WIDTH, LENGTH, INCLINE))


def run(duration=0.6, blind=()):
    """Returns (diagram, simulator, system, rows of `TrackPoint` at the estimator's slot)."""
    builder = DiagramBuilder()
    centroids = builder.AddSystem(Centroids(blind))
    system = builder.AddSystem(make())
    builder.Connect(centroids.get_output_port(), system.GetInputPort("centroid"))
    log = LogVectorOutput(system.GetOutputPort("point"), builder, publish_period=TIME_STEP / 4)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(duration)
    found = log.FindLog(simulator.get_context())
    phase = np.mod(found.sample_times() - vision_slot(ESTIMATOR_SLOT) + 1e-9, VISION_PERIOD)
    at_estimator = phase < 1e-6
    return diagram, simulator, system, found.sample_times()[at_estimator], found.data().T[at_estimator]


def test_the_point_is_where_the_ball_was_and_reaches_the_estimator_in_the_same_plant_step():
    _, _, _, times, rows = run(blind=(20,))
    X_WB = board_pose()
    points = [(t, TrackPoint(row)) for t, row in zip(times, rows) if row[0] > 0.0]
    assert len(points) > 25
    for time, point in points:
        assert time - vision_slot(ESTIMATOR_SLOT) - point.stamp == pytest.approx(LAG, abs=1e-9)
        cycle = round(point.stamp / VISION_PERIOD)
        assert point.gap == 0.0 and point.valid == (cycle not in (1, 2, 3, 11, 20))
        expected = X_WB[:3, :3] @ path(point.stamp) + X_WB[:3, 3] if point.valid else np.zeros(3)
        assert [point.x, point.y, point.z] == pytest.approx(expected, abs=1e-9)


def test_all_memory_is_in_the_context():
    diagram, simulator, system, _, _ = run(0.3)
    context = simulator.get_context()
    replayed = Simulator(diagram, context.Clone())
    points = []
    for each in (simulator, replayed):
        each.AdvanceTo(0.5)
        mine = system.GetMyContextFromRoot(each.get_context())
        points.append(system.GetOutputPort("point").Eval(mine).copy())
    assert points[0].any() and (points[0] == points[1]).all()
    memory = system.GetMyContextFromRoot(context).get_abstract_state(0).get_value()
    assert copy.deepcopy(memory) is memory and not memory.point.flags.writeable


def test_ports():
    system = make()
    assert not system.HasAnyDirectFeedthrough()
    assert not system.GetOutputPort("point").Eval(system.CreateDefaultContext()).any()
