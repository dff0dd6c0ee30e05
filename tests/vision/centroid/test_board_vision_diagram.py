import numpy as np
import pytest
from ball_pictures import (
    BALL_RADIUS,
    INCLINE,
    LENGTH,
    SIZE,
    WIDTH,
    board_pose,
    camera_pose,
    draw_board,
    intrinsics,
    put_ball,
    shoot,
)
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Centroid, TrackPoint
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.vision.centroid.background_difference import BackgroundDifferenceDetector
from drake_tracker.vision.centroid.board_vision_diagram import BoardVisionDiagram
from drake_tracker.vision.centroid.config import BackgroundDifference, FrameDifference
from drake_tracker.vision.centroid.frame_difference import FrameDifferenceDetector
from drake_tracker.vision.centroid.plane_projection import PlausiblePoints, board_window, camera_on_board
from drake_tracker.vision.centroid.search_window import SearchWindow

TIME_STEP = 1 / 600
X_CB = camera_pose()
CAMERA = camera_on_board(intrinsics(), X_CB, SIZE, SIZE)
BOARD = draw_board(X_CB, samples=2)
START = 0.3
"""The ball is released then [s]."""


def path(time):
    """p_BQ [m] of the centre of a ball that rolls freely from rest."""
    y = 0.84 - 0.3 * 9.81 * np.sin(INCLINE) * np.maximum(np.asarray(time) - START, 0.0) ** 2
    return np.stack([np.full_like(y, 0.12), y, np.full_like(y, BALL_RADIUS)], axis=-1)


class Film(LeafSystem):
    """What the camera sees of the rolling ball."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractOutputPort("image", lambda: AbstractValue.Make(ImageRgba8U(SIZE, SIZE)), self._draw)

    def _draw(self, context, output):
        time = context.get_time()
        p_BQ = path(time)
        radius = CAMERA.K[0, 0] * BALL_RADIUS / (X_CB[2, :3] @ p_BQ + X_CB[2, 3])
        picture = put_ball(BOARD, CAMERA.project(p_BQ)[0], radius, light=(-0.2, -0.3, 0.9))
        rng = np.random.default_rng([1, round(time / VISION_PERIOD)])
        output.get_mutable_value().mutable_data[:] = shoot(picture, rng)[..., None]


def make_vision(detector=None, **settings):
    window = board_window(CAMERA, WIDTH, LENGTH, 2 * BALL_RADIUS).mask((0, 0, SIZE, SIZE))
    return BoardVisionDiagram(
        detector or FrameDifferenceDetector(window=window),
        CAMERA,
        board_pose(),
        BALL_RADIUS,
        PlausiblePoints(WIDTH, LENGTH, INCLINE),
        time_step=TIME_STEP,
        **settings,
    )


def watch(vision, duration=1.2, film=None):
    """Returns (simulator, {port: (times, rows)}) as the estimator reads them, once a cycle."""
    builder = DiagramBuilder()
    film, vision = builder.AddSystem(film or Film()), builder.AddSystem(vision)
    builder.Connect(film.get_output_port(), vision.GetInputPort("camera"))
    names = ("point", "centroid")
    logs = {name: LogVectorOutput(vision.GetOutputPort(name), builder, publish_period=TIME_STEP / 4) for name in names}
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    found = {}
    for name, log in logs.items():
        rows = log.FindLog(simulator.get_context())
        phase = np.mod(rows.sample_times() - vision_slot(ESTIMATOR_SLOT, TIME_STEP) + 1e-9, VISION_PERIOD)
        keep = phase < 1e-6
        found[name] = (rows.sample_times()[keep] - vision_slot(ESTIMATOR_SLOT, TIME_STEP), rows.data().T[keep])
    return simulator, found


def fresh(times, rows, view):
    """(time, message) of every first appearance of a stamp with a valid message."""
    seen = {}
    for time, row in zip(times, rows):
        seen.setdefault(row[0], (time, view(row)))
    return [(time, message) for time, message in seen.values() if message.valid]


def test_ports():
    vision = make_vision()
    assert [vision.get_output_port(k).get_name() for k in range(vision.num_output_ports())] == [
        "point",
        "centroid",
        "motion",
        "motion_images",
    ]
    assert [vision.get_input_port(k).get_name() for k in range(vision.num_input_ports())] == ["camera"]
    assert vision.get_name() == "vision"


@pytest.mark.parametrize("stride", [1, 2])
def test_points_lie_where_the_ball_was_at_their_stamps(stride):
    window = board_window(CAMERA, WIDTH, LENGTH, 2 * BALL_RADIUS).mask((0, 0, SIZE, SIZE))
    vision = make_vision(FrameDifferenceDetector(FrameDifference(stride=stride), window=window))
    simulator, logged = watch(vision)
    X_WB = board_pose()
    points = fresh(*logged["point"], TrackPoint)
    assert len(points) >= 9
    # A ball that moves by less than a pixel between its images shows on one side first.
    late = [point for _, point in points if point.stamp > START + 0.3]
    for point in late:
        p_WQ = X_WB[:3, :3] @ path(point.stamp) + X_WB[:3, 3]
        assert np.linalg.norm(np.array([point.x, point.y, point.z]) - p_WQ) < 0.008
        assert point.gap == 0.0
    # An update rate of 4 cycles and a throughput of 6 from the first image, which is half a stride before the stamp.
    times = [time for time, _ in points]
    assert np.diff(times) == pytest.approx(4 * VISION_PERIOD)
    for time, point in points:
        assert time - point.stamp == pytest.approx((6 - stride / 2) * VISION_PERIOD)
    assert vision.lag == pytest.approx((6 - stride / 2) * VISION_PERIOD)
    centroids = fresh(*logged["centroid"], Centroid)
    assert [time for time, _ in centroids][-len(points) :] == times
    context = vision.GetMyContextFromRoot(simulator.get_context())
    assert vision.GetOutputPort("motion").Eval(context).mask.any()
    assert vision.GetOutputPort("motion_images").Eval(context).motion_energy.any()


def test_nothing_moves_before_the_release():
    _, logged = watch(make_vision(), START)
    _, rows = logged["point"]
    assert not any(TrackPoint(row).valid for row in rows) and rows[-1][0] > 0.1


def test_a_detector_of_single_images_has_the_whole_throughput_for_a_lag():
    detector = BackgroundDifferenceDetector(BackgroundDifference(threshold=6.0), image=BOARD.astype(np.uint8))
    vision = make_vision(detector, update_cycles=2)
    assert vision.lag == pytest.approx(6 * VISION_PERIOD)
    _, logged = watch(vision, 0.7)
    points = fresh(*logged["point"], TrackPoint)
    assert np.diff([time for time, _ in points]) == pytest.approx(2 * VISION_PERIOD)
    p_WQ = board_pose()[:3, :3] @ path(points[-1][1].stamp) + board_pose()[:3, 3]
    assert np.linalg.norm(points[-1][1][1:4] - p_WQ) < 0.008


def test_a_throughput_that_the_images_do_not_leave_is_refused():
    with pytest.raises(DrakeTrackerError, match="a lag of 1 cycles"):
        make_vision(throughput_cycles=2)


def test_a_window_that_goes_with_the_ball_leaves_out_another_thing_that_moves():
    """A hand's shadow that enters at the lower edge, larger than the ball."""

    class Disturbed(Film):
        def _draw(self, context, output):
            super()._draw(context, output)
            step = max(0, 3 * round((context.get_time() - 0.8) / VISION_PERIOD))
            u, v = np.rint(CAMERA.project((-0.1, 0.1, 0.0))[0]).astype(int)
            if step > 0:
                output.get_mutable_value().mutable_data[v - 8 : v + 8, u - 40 + step : u - 20 + step] //= 2

    def found(follow):
        _, logged = watch(make_vision(follow=follow), 1.15, Disturbed())
        return [c for _, c in fresh(*logged["centroid"], Centroid) if c.stamp > 0.85]

    def errors(centroids):
        return [np.hypot(*(CAMERA.project(path(c.stamp))[0] - (c.u, c.v))) for c in centroids]

    whole, followed = found(None), found(SearchWindow())
    assert len(whole) == len(followed) >= 3
    assert max(errors(whole)) > 20.0
    assert max(errors(followed)) < 1.5
