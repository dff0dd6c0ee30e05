import numpy as np
import pytest

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.region_of_interest import project_region

K = np.array([[400.0, 0.0, 127.5], [0.0, 400.0, 127.5], [0.0, 0.0, 1.0]])


def camera(tilt_deg=30.0, distance=1.5, yaw_deg=20.0):
    """A camera that looks at the origin of W from above, tilted and turned."""
    a, b = np.radians([tilt_deg, yaw_deg])
    R_turn = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    R_tilt = np.array([[1, 0, 0], [0, -np.cos(a), -np.sin(a)], [0, np.sin(a), -np.cos(a)]])
    X_CW = np.eye(4)
    X_CW[:3, :3] = R_tilt @ R_turn
    X_CW[2, 3] = distance
    return CameraModel(K, np.zeros(5), X_CW, 256, 256)


BOX = np.array([[-0.15, -0.1, 0.0], [0.15, 0.1, 0.05]])


def test_mask_holds_the_work_volume_and_little_else():
    view = camera()
    window = project_region(view, BOX)
    mask = window.mask((0, 0, 256, 256))
    inside = np.random.default_rng(0).uniform(*BOX, (4000, 3))
    u, v = np.rint(view.project(inside)).astype(int).T
    assert (mask[v, u] == 255).all()
    x, y = window.polygon.T
    area = 0.5 * abs(x @ np.roll(y, 1) - y @ np.roll(x, 1))
    assert (mask > 0).sum() == pytest.approx(area, rel=0.05)


def test_corners_of_the_polygon_are_projected_corners():
    view = camera()
    window = project_region(view, BOX)
    corners = view.project(np.array([[x, y, z] for x in BOX[:, 0] for y in BOX[:, 1] for z in BOX[:, 2]]))
    for corner in window.polygon:
        assert np.hypot(*(corners - corner).T).min() < 1e-3
    assert not window.polygon.flags.writeable


def test_bounds_are_even_padded_and_inside_the_frame():
    for distance in (0.9, 1.2, 2.0, 3.3):
        window = project_region(camera(distance=distance), BOX, padding=4)
        u0, v0, width, height = window.bounds
        assert u0 % 2 == v0 % 2 == width % 2 == height % 2 == 0
        low, high = window.polygon.min(axis=0), window.polygon.max(axis=0)
        assert (np.array([u0, v0]) <= np.maximum(low - 4, 0)).all()
        assert (np.array([u0 + width - 1, v0 + height - 1]) >= np.minimum(high + 4, 255)).all()
        assert u0 >= 0 and v0 >= 0 and u0 + width <= 256 and v0 + height <= 256


def test_mask_of_a_part_is_a_part_of_the_mask():
    window = project_region(camera(), BOX)
    u0, v0, width, height = window.bounds
    whole = window.mask((0, 0, 256, 256))
    assert (window.mask() == whole[v0 : v0 + height, u0 : u0 + width]).all()
    assert whole.sum() == window.mask().sum()


def test_a_volume_that_cannot_be_seen_is_refused():
    with pytest.raises(DrakeTrackerError, match="behind a camera"):
        project_region(camera(), BOX + [0.0, 0.0, 2.0])
    with pytest.raises(DrakeTrackerError, match="does not see the work volume"):
        project_region(camera(), BOX + [3.0, 0.0, 0.0])
    with pytest.raises(DrakeTrackerError, match="must be two corners"):
        project_region(camera(), [0.0, 0.0, 1.0])
