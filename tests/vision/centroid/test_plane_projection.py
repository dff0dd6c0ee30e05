import numpy as np
import pytest
from ball_pictures import BALL_RADIUS, INCLINE, LENGTH, SIZE, WIDTH, camera_pose, intrinsics

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.plane_projection import (
    ROLL,
    LastPoint,
    PlausiblePoints,
    board_window,
    camera_on_board,
    project_to_plane,
    seen_whole_from,
)

CAMERA = camera_on_board(intrinsics(), camera_pose(), SIZE, SIZE)
PLAUSIBLE = PlausiblePoints(WIDTH, LENGTH, INCLINE)
PERIOD = 4 / 60


def judge_all(points, plausible=PLAUSIBLE):
    """Which of the points (stamp, x, y) are accepted."""
    last, verdicts = LastPoint(), []
    for stamp, x, y in points:
        accepted, last = plausible.judge(last, stamp, np.array([x, y, BALL_RADIUS]))
        verdicts.append(accepted)
    return verdicts


def test_a_pixel_goes_back_to_where_it_came_from():
    for p_BQ in ((0.0, 0.45, BALL_RADIUS), (-0.28, 0.02, BALL_RADIUS), (0.25, 0.88, BALL_RADIUS)):
        found = project_to_plane(CAMERA, CAMERA.project(p_BQ)[0], BALL_RADIUS)
        assert found == pytest.approx(p_BQ, abs=1e-9)


def test_the_height_of_the_centre_matters():
    p_BQ = np.array([0.1, 0.4, BALL_RADIUS])
    on_board = project_to_plane(CAMERA, CAMERA.project(p_BQ)[0], 0.0)
    assert 0.01 < np.linalg.norm(on_board[:2] - p_BQ[:2]) < 0.05


def test_a_ray_away_from_the_board_meets_nothing():
    horizon = CAMERA.K @ CAMERA.X_CW[:3, :3] @ [0.0, -1.0, 0.0]  # the vanishing point of the slope, and beyond it
    uv = horizon[:2] / horizon[2]
    assert project_to_plane(CAMERA, uv - (0.0, 40.0), BALL_RADIUS) is None


def test_points_beyond_the_board_are_rejected():
    assert judge_all([(0.1, 0.0, LENGTH + 0.01), (0.2, 0.31, 0.4), (0.3, -0.31, 0.4), (0.4, 0.0, -0.01)]) == [False] * 4
    assert judge_all([(0.1, 0.29, 0.01)]) == [True]


def test_a_rolling_ball_is_accepted_and_a_jump_is_rejected():
    """A hollow sphere rolls with 3/5 of g sin a; one point in between jumps across the board."""
    stamps = PERIOD * np.arange(1, 20)
    y = 0.84 - 0.3 * 9.81 * np.sin(INCLINE) * stamps**2
    points = [(t, 0.1, place) for t, place in zip(stamps, y) if place > 0.0]
    assert len(points) > 15 and all(judge_all(points))
    points[8] = (points[8][0], -0.25, points[8][2])
    assert judge_all(points) == [True] * 8 + [False] + [True] * (len(points) - 9)


def test_after_several_rejections_in_a_row_it_starts_again():
    points = [(0.1, -0.25, 0.8)] + [(0.1 + k * 0.02, 0.2, 0.8) for k in range(1, 7)]
    assert judge_all(points) == [True] + 3 * [False] + 3 * [True]


def test_the_limit_is_the_speed_of_free_sliding():
    g_sin = 9.81 * np.sin(INCLINE)
    time = np.sqrt(2 * 0.5 / g_sin)  # from rest over 0.5 m
    assert PLAUSIBLE.limit(LENGTH - 0.5, 1.0) - PLAUSIBLE.tolerance == pytest.approx(g_sin * time)
    assert PLAUSIBLE.limit(LENGTH, 1.0) == PLAUSIBLE.tolerance


def test_the_window_holds_every_ball_that_is_far_enough_from_the_bottom_and_nothing_beyond():
    window = board_window(CAMERA, WIDTH, LENGTH, 2 * BALL_RADIUS)
    mask = window.mask((0, 0, SIZE, SIZE))
    edge = WIDTH / 2 - BALL_RADIUS
    for x, y in ((0, 0.45), (edge, 0.12), (-edge, 0.12), (edge, 0.87), (-edge, 0.87)):
        u, v = np.rint(CAMERA.project((x, y, BALL_RADIUS))[0]).astype(int)
        assert mask[v - 1 : v + 2, u - 1 : u + 2].all()
    assert not mask[:8].any() and not mask[-8:].any()
    # A hand that stands beyond the edge is not looked at, not even its lowest part.
    beyond = CAMERA.project([(x, -0.01, z) for x in np.linspace(-0.25, 0.25, 11) for z in (0.0, 0.1)])
    assert not any(mask[int(v), int(u)] for u, v in beyond)
    inner = board_window(CAMERA, WIDTH, LENGTH, 2 * BALL_RADIUS, bottom=0.2).mask((0, 0, SIZE, SIZE))
    assert np.count_nonzero(inner > mask) < 0.001 * mask.size  # but for the rounding of corners
    assert inner.sum() < 0.9 * mask.sum()
    with pytest.raises(DrakeTrackerError, match="leaves nothing"):
        board_window(CAMERA, WIDTH, LENGTH, 2 * BALL_RADIUS, bottom=2.0)


def test_a_ball_is_seen_whole_from_where_its_outline_leaves_the_rim():
    bottom = 0.2
    mask = board_window(CAMERA, WIDTH, LENGTH, 2 * BALL_RADIUS, bottom).mask((0, 0, SIZE, SIZE))
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    sphere = BALL_RADIUS * np.array(
        [[np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), np.cos(b)] for a in angles for b in angles]
    )
    lowest = seen_whole_from(CAMERA, bottom, BALL_RADIUS) - ROLL
    for y, whole in ((lowest + 0.01, True), (lowest - 0.01, False)):
        u, v = np.rint(CAMERA.project(sphere + [0.0, y, BALL_RADIUS])).astype(int).T
        assert mask[v, u].all() == whole


@pytest.mark.parametrize("change", [{"width": 0.0}, {"incline": -0.1}, {"tolerance": np.nan}, {"restart_after": 0}])
def test_settings_out_of_range_are_refused(change):
    with pytest.raises(DrakeTrackerError, match=f"plane projection: {next(iter(change))} is"):
        PlausiblePoints(**{"width": WIDTH, "length": LENGTH, "incline": INCLINE, **change})
