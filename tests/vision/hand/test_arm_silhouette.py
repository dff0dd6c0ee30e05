import numpy as np
import pytest

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.vision.hand.arm_silhouette import NEAREST, ArmSilhouette
from drake_tracker.vision.region_of_interest import project_region
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, true_camera_models
from drake_tracker.world.train.tracks import make_track
from drake_tracker.world.train.world_diagram import WorldDiagram

WORK_VOLUME = [[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]]
WINDOW = (20, 10, 60, 50)
K = np.array([[100.0, 0.0, 49.5], [0.0, 100.0, 39.5], [0.0, 0.0, 1.0]])
STRONG_LENS = np.array([-0.35, 0.12, 0.0, 0.0, 0.0])


def camera(distortion=np.zeros(5)):
    """A camera of 100 x 80 px in the origin of W that looks along z."""
    return CameraModel(K, distortion, np.eye(4), 100, 80)


def box(centre, size):
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return np.asarray(centre) + 0.5 * np.asarray(size) * corners


def drawn(*pieces, margin=0, window=WINDOW, distortion=np.zeros(5)):
    return ArmSilhouette(camera(distortion), window, margin=margin).mask(pieces)


def extent(mask):
    rows, columns = np.nonzero(mask)
    return columns.min(), columns.max(), rows.min(), rows.max()


def test_a_square_appears_where_the_camera_sees_it_and_grows_by_the_margin():
    square = box([0.0, 0.0, 1.0], [0.2, 0.1, 0.0])
    assert extent(drawn(square)) == pytest.approx((19.5, 39.5, 24.5, 34.5), abs=1)
    left, right, top, bottom = extent(drawn(square))
    assert extent(drawn(square, margin=3)) == (left - 3, right + 3, top - 3, bottom + 3)
    assert drawn(square).shape == (50, 60)


def test_what_is_just_outside_the_window_grows_into_it():
    square = box([-0.36, 0.0, 1.0], [0.1, 0.1, 0.0])
    assert not drawn(square).any()
    assert drawn(square, margin=3)[24:35, 0].all() and not drawn(square, margin=3)[:, 3:].any()


def test_a_displaced_square_is_that_of_another_place():
    square, elsewhere = box([0.0, 0.0, 1.0], [0.2, 0.1, 0.0]), box([0.08, -0.05, 1.0], [0.2, 0.1, 0.0])
    silhouette = ArmSilhouette(camera(), WINDOW, margin=0)
    assert np.array_equal(silhouette.mask([square], (8.0, -5.0)), drawn(elsewhere))
    beside = box([-0.36, 0.0, 1.0], [0.1, 0.1, 0.0])
    assert silhouette.mask([beside], (5.0, 0.0)).any() and not silhouette.mask([square], (60.0, 0.0)).any()


def test_several_pieces_and_none():
    near, far = box([-0.1, 0.0, 1.0], [0.05, 0.05, 0.05]), box([0.1, 0.0, 2.0], [0.05, 0.05, 0.05])
    assert np.array_equal(drawn(near, far), drawn(near) | drawn(far))
    assert not drawn().any()


@pytest.mark.parametrize("centre", [[0.0, 0.0, -1.0], [3.0, 0.0, 1.0], [0.0, -3.0, 1.0]])
def test_a_piece_behind_the_camera_or_beside_the_window_is_skipped(centre):
    assert not drawn(box(centre, [0.2, 0.2, 0.2])).any()


def test_a_piece_across_the_plane_of_the_camera_is_cut_there():
    """A beam from far behind the camera to 1 m in front, 0.1 m to its right: its image begins at x = .1 / 1."""
    mask = drawn(box([0.15, 0.0, -1.0], [0.1, 0.02, 4.0]))
    left, right, _, _ = extent(mask)
    assert left == pytest.approx(K[0, 2] + 10.0 - WINDOW[0], abs=1) and right == 59
    whole = drawn(box([0.15, 0.0, 0.5 * (1.0 + NEAREST)], [0.1, 0.02, 1.0 - NEAREST]))
    assert np.array_equal(mask, whole)


@pytest.mark.parametrize("distortion", [np.zeros(5), STRONG_LENS], ids=["pinhole", "lens"])
def test_a_piece_that_reaches_far_out_of_the_image_is_drawn_in_it(distortion):
    """Far outside the image the model of the lens folds back: a bar to x = 6 must not lose its part in the window."""
    whole = (0, 0, 100, 80)
    mask = drawn(box([3.05, 0.0, 1.0], [5.9, 0.1, 0.0]), window=whole, distortion=distortion)
    seen = camera(distortion).project([[0.1, 0.0, 1.0]])[0, 0]
    row = mask[40]
    assert not row[: int(seen) - 1].any() and row[int(seen) + 2 :].all()
    assert np.count_nonzero(mask.any(axis=1)) < 16


class Scene:
    """The train's laboratory as two cameras see it: which pixels belong to the links that move."""

    def __init__(self, elevation_deg):
        config = CamerasConfig(noise=0.0, elevation_deg=elevation_deg)
        self.cameras = true_camera_models(config)
        self.windows = {name: project_region(self.cameras[name], WORK_VOLUME).bounds for name in CAMERA_NAMES}
        self.track = make_track("oval")
        laboratory = WorldConfig(arm=PUMA560, q_initial=PUMA560.q_start, windows=self.windows)
        self.world = WorldDiagram(laboratory, track=self.track, start=1.2, cameras=config)
        self.context = self.world.CreateDefaultContext()
        laboratory = self.world.laboratory
        plant = laboratory.plant
        bodies = [plant.get_body(b) for m in (laboratory.arm, laboratory.gripper) for b in plant.GetBodyIndices(m)]
        self.labels = [int(body.index()) for body in bodies if not plant.IsAnchored(body)]

    def pixels(self, q, jaw_width):
        """{name: mask of the arm's pixels in the window} as rendered."""
        laboratory = self.world.laboratory
        context = laboratory.plant.GetMyMutableContextFromRoot(self.context)
        laboratory.plant.SetPositions(context, laboratory.arm, q)
        laboratory.plant.SetPositions(context, laboratory.gripper, [0.5 * jaw_width] * 2)
        masks = {}
        for name, seen in self.world.cameras.items():
            labels = seen.sensor.label_image_output_port().Eval(seen.sensor.GetMyContextFromRoot(self.context)).data
            u0, v0, width, height = self.windows[name]
            left, top = u0 - seen.window[0], v0 - seen.window[1]
            masks[name] = np.isin(labels[top : top + height, left : left + width, 0], self.labels)
        return masks


@pytest.mark.parametrize("elevation_deg", [20.0, 45.0])
def test_the_silhouette_covers_the_rendered_arm_and_little_else(elevation_deg):
    """At home, over the track and in the descent; without a margin it is as tight as the hulls of the links."""
    scene, model, shape = Scene(elevation_deg), make_arm_model(PUMA560), ArmShape(PUMA560)
    home = joints_for(model, PUMA560.q_start, tool_down([0.56, 0.0, 0.70], np.pi))
    tight, wide = (
        {name: ArmSilhouette(scene.cameras[name], scene.windows[name], margin=margin) for name in CAMERA_NAMES}
        for margin in (0, 3)
    )
    arm_pixels = []
    for place, height, jaw_width in ((0.0, 0.70, 0.088), (0.1, 0.60, 0.088), (0.1, 0.50, 0.04), (0.9, 0.55, 0.06)):
        q = joints_for(model, home, tool_down([*scene.track.pose(place)[:2], height], np.pi))
        pieces = shape.pieces(q, jaw_width)
        for name, arm in scene.pixels(q, jaw_width).items():
            mask, grown = tight[name].mask(pieces) > 0, wide[name].mask(pieces) > 0
            assert arm[~grown].sum() == 0
            assert arm[mask].sum() >= 0.99 * arm.sum() or arm.sum() < 30
            assert mask.sum() < 2.0 * arm.sum() or arm.sum() < 30
            arm_pixels.append(arm.sum())
    assert max(arm_pixels) > 2000
