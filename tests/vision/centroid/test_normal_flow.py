import numpy as np
import pytest
from scipy import ndimage

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector, erode_isolated

PERIOD = 1.0 / 60.0
ROWS, COLUMNS = np.mgrid[0:120, 0:160].astype(float)


def box(u, v, half_width=20.0, half_height=8.0, texture=15.0, noise=0.0, light=1.0, table=45.0, seed=0):
    """A bright body centred at (u, v) on a dark textured table, each pixel covered in proportion."""

    def cover(coordinate, centre, half):
        return np.clip(half + 0.5 - np.abs(coordinate - centre), 0.0, 1.0)

    alpha = cover(COLUMNS, u, half_width) * cover(ROWS, v, half_height)
    body = 115.0 + table + texture * np.sin(0.9 * (COLUMNS - u)) * np.cos(0.7 * (ROWS - v))
    table = table + 8.0 * np.sin(0.31 * COLUMNS + 0.1 * ROWS) * np.sin(0.43 * ROWS)
    image = light * ((1.0 - alpha) * table + alpha * body)
    image += np.random.default_rng([seed, 1]).normal(scale=noise, size=image.shape) if noise else 0.0
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def ramp(shift, slope_x, slope_y=0.0):
    """A plane of brightness that has moved ``shift`` px along its gradient."""
    size = np.hypot(slope_x, slope_y)
    image = 110.0 + slope_x * (COLUMNS - 80.0) + slope_y * (ROWS - 60.0) - size * shift
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def detect(flow, pictures):
    """Returns (mask, region) of buffered pictures given as a function of the cycle, I1 being cycle 0."""
    images = [flow.smooth(pictures(cycle)) for cycle in (-flow.stride, 0, flow.stride)]
    mask = flow.mask(*images)
    return mask, flow.centroid(mask)


def test_integer_path_agrees_with_the_float_path():
    for overrides in ({}, {"norm": "l2"}, {"centroid": "hull"}, {"threshold_px": 0.25}):
        flows = [NormalFlowDetector(NormalFlow(path=path, **overrides)) for path in ("integer", "float")]
        for k in range(12):

            def pictures(cycle, k=k):
                t = cycle + 3.3 * k
                return box(60.0 + 0.83 * t, 50.0 + 0.37 * t, noise=2.0, seed=100 * k + cycle + 9)

            (_, integer), (_, exact) = (detect(flow, pictures) for flow in flows)
            assert integer.pixel_count > 50
            assert np.hypot(integer.u - exact.u, integer.v - exact.v) < 0.05


@pytest.mark.parametrize("preset", ["paper_literal", "paper_interlaced"])
@pytest.mark.parametrize("path", ["integer", "float"])
def test_threshold_is_10_px_per_60_ms(preset, path):
    flow = NormalFlowDetector(NormalFlow(preset, centroid="mean", path=path))
    inner = np.s_[50:70, 70:90]  # Away from the ramp's ends.
    for px_per_60ms, moves in ((9.5, False), (10.5, True)):
        speed = px_per_60ms / 0.060
        mask, _ = detect(flow, lambda cycle, speed=speed: ramp(speed * PERIOD * cycle, 2.0))
        assert (mask[inner] == (255 if moves else 0)).all()


def test_l1_norm_is_the_larger_one_across_a_diagonal():
    diagonal = {"slope_x": 1.5, "slope_y": 1.5}
    inner = np.s_[50:70, 70:90]
    speed = 12.0 / 0.060
    for norm, moves in (("l1", False), ("l2", True)):
        flow = NormalFlowDetector(NormalFlow("paper_literal", centroid="mean", norm=norm))
        mask, _ = detect(flow, lambda cycle: ramp(speed * PERIOD * cycle, **diagonal))
        assert (mask[inner] == (255 if moves else 0)).all()


def test_intermediate_images_are_in_grey_levels_and_pixels():
    for path in ("integer", "float"):
        flow = NormalFlowDetector(NormalFlow(path=path, normalise_gain=False))
        pictures = [flow.smooth(ramp(1.5 * cycle, 3.0, 4.0)) for cycle in (-2, 0, 2)]
        images = flow.images(*pictures)
        inner = np.s_[50:70, 70:90]
        assert images.gradient_x[inner] == pytest.approx(3.0, abs=0.02)
        assert images.gradient_y[inner] == pytest.approx(4.0, abs=0.02)
        # Six px along a gradient of 5 grey/px, which comes out as 30 / 7 px in the L1 norm.
        assert images.difference[inner] == pytest.approx(-30.0, abs=0.05)
        assert images.normal_speed[inner] == pytest.approx(30.0 / 7.0 / (4.0 * PERIOD), rel=0.01)
        assert images.smoothed[60, 80] == pytest.approx(110.0, abs=0.05)
        assert (images.motion_energy == flow.mask(*pictures)).all()


def test_erosion_takes_exactly_the_isolated_pixels():
    moving = np.random.default_rng(3).random((60, 80)) < 0.06
    moving[0, 0] = moving[0, 1] = moving[59, 79] = True
    around = np.ones((3, 3))
    around[1, 1] = 0
    neighbours = ndimage.convolve(moving.astype(int), around, mode="constant")
    expected = np.where(moving & (neighbours > 0), 255, 0)
    assert 0 < (expected > 0).sum() < moving.sum()
    assert (erode_isolated(moving) == expected).all()


def test_whole_coordinates_are_pixel_centres():
    for centroid in ("mean", "hull"):
        flow = NormalFlowDetector(NormalFlow(centroid=centroid, join_distance=40))
        _, region = detect(flow, lambda cycle: box(70.0 + 1.0 * cycle, 50.0, texture=0.0))
        assert (region.u, region.v) == pytest.approx((70.0, 50.0), abs=0.15)


@pytest.mark.parametrize("centroid", ["mean", "hull"])
def test_follows_a_textured_body_under_noise(centroid):
    flow = NormalFlowDetector(NormalFlow(centroid=centroid))
    errors = []
    for k in range(15):

        def centre(cycle, k=k):
            t = cycle + 4.0 * k
            return np.array([45.0 + 0.87 * t, 40.0 + 0.55 * t])

        _, region = detect(flow, lambda cycle, k=k: box(*centre(cycle), noise=2.0, seed=50 * k + cycle + 5))
        errors.append(np.array(region[:2]) - centre(0))
    assert np.sqrt(np.mean(np.square(errors))) < 0.5


def test_guards_hold_against_flicker_and_noise():
    def worst(light, noise, table, **overrides):
        flow = NormalFlowDetector(NormalFlow(centroid="mean", **overrides))
        distance = 0.0
        for k in range(6):

            def picture(cycle, k=k):
                time = (cycle + 20 * k) * PERIOD
                lit = 1.0 + light * np.sin(2 * np.pi * 100.0 * time + 0.4)
                return box(50.0 + 0.9 * cycle, 40.0, noise=noise, light=lit, table=table, seed=99 * k + cycle + 7)

            _, region = detect(flow, picture)
            distance = max(distance, np.hypot(region.u - 50.0, region.v - 40.0) if region else np.inf)
        return distance

    # A brighter table than the default flickers by more than the least difference of a moving pixel.
    assert worst(light=0.05, noise=2.0, table=110.0) < 1.0
    assert worst(light=0.05, noise=2.0, table=110.0, normalise_gain=False, noise_factor=0.0) > 10.0
    assert worst(light=0.0, noise=8.0, table=45.0) < 1.5
    assert worst(light=0.0, noise=8.0, table=45.0, noise_factor=0.0) > 10.0


def test_no_motion_no_centroid():
    rng = np.random.default_rng(5)
    still = box(80.0, 60.0)
    dark = np.zeros_like(still)
    for preset in ("scaled", "paper_literal", "paper_interlaced"):
        for path in ("integer", "float"):
            centroid = "hull" if preset == "scaled" else "mean"
            flow = NormalFlowDetector(NormalFlow(preset, centroid=centroid, path=path))
            pictures = {cycle: box(80.0, 60.0, noise=2.0, seed=cycle + 9) for cycle in range(-2, 3)}
            assert detect(flow, pictures.get)[1] is None
            assert detect(flow, lambda cycle: dark)[1] is None
    # A light switched off and on again is not an object as large as the image.
    flow = NormalFlowDetector()
    for sequence in ((still, still, dark), (still, dark, dark), (dark, dark, still), (dark, still, still)):
        noisy = [np.clip(image + rng.integers(0, 3, still.shape), 0, 255).astype(np.uint8) for image in sequence]
        images = [flow.smooth(image) for image in noisy]
        assert not flow.mask(*images).any()


def test_only_the_window_is_looked_at():
    window = np.zeros(ROWS.shape, np.uint8)
    window[:, :80] = 255

    def two_bodies(cycle):
        return np.maximum(box(40.0 + cycle, 50.0), box(120.0, 60.0 + cycle))

    for path in ("integer", "float"):
        settings = NormalFlow(path=path, centroid="mean")
        whole, _ = detect(NormalFlowDetector(settings), two_bodies)
        mask, region = detect(NormalFlowDetector(settings, window=window), two_bodies)
        assert whole[:, 90:].any()
        assert not mask[:, 80:].any()
        assert (region.u, region.v) == pytest.approx((40.0, 50.0), abs=1.0)
    with pytest.raises(DrakeTrackerError, match="window of interest is empty"):
        NormalFlowDetector(settings, window=np.zeros(ROWS.shape, np.uint8))


@pytest.mark.parametrize("preset", ["scaled", "paper_literal", "paper_interlaced"])
def test_smallest_visible_speed_bounds_what_an_edge_shows(preset):
    flow = NormalFlowDetector(NormalFlow(preset))
    speed = flow.parameters.smallest_visible_speed(contrast=150.0)

    def seen(factor):
        shift = factor * speed * PERIOD

        def edge(start):
            def picture(cycle):
                covered = np.clip(80.5 + start + shift * cycle - COLUMNS, 0.0, 1.0)
                return np.rint(40.0 + 150.0 * covered).astype(np.uint8)

            return picture

        # The position of the edge within a pixel decides what the pixels see: try several.
        return any(detect(flow, edge(start))[0].any() for start in np.linspace(0.0, 1.0, 8, endpoint=False))

    assert not seen(0.93)
    assert seen(1.07)


def test_smallest_visible_speed_of_the_presets():
    speeds = {
        name: NormalFlow(name).resolve().smallest_visible_speed()
        for name in ("scaled", "paper_literal", "paper_interlaced")
    }
    assert speeds["scaled"] < speeds["paper_interlaced"] < speeds["paper_literal"] < 10.0 / 0.060
    assert NormalFlow().resolve().smallest_visible_speed(contrast=5.0) == np.inf


def test_presets_and_overrides():
    literal = NormalFlow("paper_literal").resolve()
    assert literal.displacement_threshold == pytest.approx(10.0 * (2 / 60) / 0.060)
    assert NormalFlow("paper_interlaced").resolve().displacement_threshold == pytest.approx(11.11, abs=0.01)
    changed = NormalFlow("paper_literal", stride=2, threshold_px=None)
    assert changed.resolve() == NormalFlow("paper_interlaced").resolve()
    assert NormalFlow(normalise_gain=False).resolve().normalise_gain is False


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"stride": 0}, "stride is 0; it must be a whole number from 1 to 4 cycles"),
        ({"stride": 1.5}, "whole number"),
        ({"threshold_px": float("nan")}, "threshold_px is nan"),
        ({"norm": "l3"}, "must be one of l1, l2"),
        ({"smoothing_size": 4}, "must be odd"),
        ({"preset": "papr"}, "must be one of scaled, paper_literal, paper_interlaced"),
        ({"centroid": None}, "centroid is None"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(DrakeTrackerError, match=f"normal flow: .*{message}"):
        NormalFlowDetector(NormalFlow(**settings))
