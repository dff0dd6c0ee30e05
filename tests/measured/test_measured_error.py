"""The measured error: what was put in comes out, and what comes out is what is fitted again."""

import math

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.measured.measured_error import LONGEST_GAP, MeasuredError, pattern_at
from drake_tracker.measured.measured_error_file import load_error, save_error
from drake_tracker.measured.measured_error_fit import (
    HEADINGS,
    Sighting,
    autocovariance,
    combine,
    evaluate_bias,
    fit_speed,
    moving_average,
)

PIXEL = 0.003
HEADING = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS


def made(pattern=0.0, jitter=(0.2e-3, 0.5e-3, 0.2e-3), missing=(0.0, 1.0), speeds=(0.1, 0.2), seen_from=0.01):
    """An error of known parts, at the second speed twice that at the first."""
    straight = np.column_stack([0.003 * np.cos(HEADING), 0.002 * np.sin(HEADING), np.full(HEADINGS, -0.001)])
    bent = np.column_stack([0.0 * HEADING, np.full(HEADINGS, 2e-4), 0.0 * HEADING])
    bias = np.stack([np.stack([straight, bent]) * k for k in range(1, len(speeds) + 1)])
    kernel = np.tile(jitter, (len(speeds), 3, 1))
    return MeasuredError(
        np.array(speeds),
        bias,
        np.full((len(speeds), 3), pattern),
        kernel,
        np.tile(missing, (len(speeds), 1)),
        PIXEL,
        seen_from,
    )


def laps(error, seed=0, cycles=2400, radius=0.15, speed=0.1, sense=1.0):
    """The `Sighting` of an object on a circle, seen with an error."""
    angle = sense * speed / radius / 60.0 * np.arange(cycles)
    xy = np.column_stack([0.56 + radius * np.cos(angle), radius * np.sin(angle)])
    yaw = angle + sense * 0.5 * np.pi
    rate = np.full(cycles, sense * speed / radius)
    rows = []
    for k in range(cycles):
        found = error.at(seed, k, xy[k], yaw[k], speed, rate[k])
        cos, sin = math.cos(yaw[k]), math.sin(yaw[k])
        x, y, z = (np.nan,) * 3 if found is None else found
        rows.append([cos * x + sin * y, cos * y - sin * x, z])
    return Sighting(xy, yaw, np.full(cycles, speed), rate, np.array(rows))


def test_the_bias_is_that_of_the_table_between_headings_speeds_and_bends():
    error = made(jitter=(0.0,))
    assert error.mean(0.0, 0.1, 0.0) == pytest.approx([0.003, 0.0, -0.001])
    assert error.mean(2.0 * np.pi * 6.0, 0.15, 0.0) == pytest.approx([0.0045, 0.0, -0.0015])
    assert error.mean(0.0, 0.9, 0.0) == pytest.approx([0.006, 0.0, -0.002]), "held beyond the last speed"
    half = 0.5 * (HEADING[1] + HEADING[2])
    assert error.mean(half, 0.1, 0.0)[0] == pytest.approx(0.0015 * (np.cos(HEADING[1]) + np.cos(HEADING[2])))
    left, right = (error.mean(np.pi / 2, 0.1, sense * 0.1 * 5.0) for sense in (1, -1))
    assert left - right == pytest.approx([0.0, 2 * 5.0 * 2e-4, 0.0])


def test_the_error_is_turned_into_the_world():
    error = made(jitter=(0.0,))
    assert error.at(0, 10, (0.5, 0.0), 0.0, 0.1, 0.0) == pytest.approx([0.003, 0.0, -0.001])
    assert error.at(0, 10, (0.5, 0.0), np.pi / 2, 0.1, 0.0) == pytest.approx([-0.002, 0.0, -0.001])


def test_errors_are_a_function_of_seed_and_cycle_and_asked_in_any_order():
    error = made(pattern=3e-4, missing=(0.1, 3.0))

    def ask(seed, cycle):
        return error.at(seed, cycle, (0.5, 0.1), 0.3, 0.1, 0.2)

    first = [ask(4, k) for k in range(50)]
    again = [ask(4, k) for k in reversed(range(50))][::-1]
    for a, b in zip(first, again):
        assert (a is None) == (b is None) and (a is None or np.array_equal(a, b))
    assert not np.array_equal(ask(4, 3), ask(5, 3))


def test_jitter_has_its_size_and_its_correlation():
    kernel = np.array([0.2e-3, 0.5e-3, 0.2e-3])
    error = made(jitter=kernel)
    noise = np.array([error.noise(1, k, (0.5, 0.0), 0.1) for k in range(6000)])
    found = autocovariance([noise], 4)
    wanted = [np.sum(kernel**2), 2 * 0.2e-3 * 0.5e-3, 0.2e-3**2, 0.0, 0.0]
    assert found == pytest.approx(np.tile(wanted, (3, 1)).T, abs=0.06 * wanted[0])
    assert abs(np.corrcoef(noise.T)[0, 1]) < 0.06


def test_the_pattern_comes_back_at_the_same_place_and_only_there():
    places = np.random.default_rng(0).uniform(0.3, 0.8, (4000, 2))
    values = np.array([pattern_at(7, xy, PIXEL) for xy in places])
    assert values.std(axis=0) == pytest.approx(np.ones(3), abs=0.05)
    assert np.array_equal(values[:20], [pattern_at(7, xy, PIXEL) for xy in places[:20]])
    beside = np.array([pattern_at(7, xy + [5 * PIXEL, 0.0], PIXEL) for xy in places])
    near = np.array([pattern_at(7, xy + [0.1 * PIXEL, 0.0], PIXEL) for xy in places])
    assert abs(np.corrcoef(values[:, 0], beside[:, 0])[0, 1]) < 0.06
    assert np.corrcoef(values[:, 0], near[:, 0])[0, 1] > 0.95


@pytest.mark.parametrize("share, length", [(0.05, 1.0), (0.2, 4.0)])
def test_drop_outs_have_their_share_and_their_length(share, length):
    error = made(missing=(share, length))
    lost = np.array([error.drops(3, k, 0.1) for k in range(20000)])
    assert lost.mean() == pytest.approx(share, rel=0.15)
    begins = np.count_nonzero(np.diff(lost.astype(int)) > 0)
    assert lost.sum() / begins == pytest.approx(length, rel=0.2)  # gaps may touch
    assert 10 * length <= LONGEST_GAP


def test_what_is_too_slow_is_not_seen():
    error = made(seen_from=0.03)
    assert error.at(0, 5, (0.5, 0.0), 0.0, 0.029, 0.0) is None
    assert error.at(0, 5, (0.5, 0.0), 0.0, 0.031, 0.0) is not None


def test_a_fit_finds_the_parts_again():
    truth = made(pattern=4e-4, jitter=(0.1e-3, 0.3e-3, 0.1e-3), missing=(0.1, 2.0))
    runs = [laps(truth, seed, sense=sense) for seed, sense in ((0, 1.0), (1, -1.0), (2, 1.0), (3, -1.0))]
    fit = fit_speed(runs, PIXEL)
    clean = made(jitter=(0.0,))
    for run in runs[:2]:
        wanted = [clean.mean(yaw, 0.1, rate) for yaw, rate in zip(run.yaw, run.yaw_rate)]
        assert np.sqrt(np.mean((evaluate_bias(fit.bias, run) - wanted) ** 2)) < 2e-4
    total = 4e-4**2 + 0.11 * 1e-6
    assert fit.std == pytest.approx(np.full(3, math.sqrt(total)), rel=0.1)
    assert fit.returns == pytest.approx(np.full(3, 4e-4**2 / total), abs=0.15)
    assert fit.missing[0] == pytest.approx(0.1, abs=0.03)
    # The model made of the fit has errors as correlated as those it was made from.
    copy = combine({0.1: fit}, PIXEL, 0.01)
    again = fit_speed([laps(copy, seed + 10, sense=run.yaw_rate[0] * 1.5) for seed, run in enumerate(runs)], PIXEL)
    assert again.std == pytest.approx(fit.std, rel=0.1)
    assert again.correlation[1:6] == pytest.approx(fit.correlation[1:6], abs=0.12)


def test_moving_average_has_the_covariance_asked_for():
    wanted = np.array([[1.0, 4.0], [0.4, 0.0], [0.1, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    kernel = moving_average(wanted)
    for axis in range(2):
        whole = np.correlate(kernel[axis], kernel[axis], "full")[kernel.shape[1] - 1 :]
        assert whole[:3] == pytest.approx(wanted[:3, axis], abs=0.1 * wanted[0, axis])
    assert np.sum(kernel**2, axis=1) == pytest.approx(wanted[0])


def test_too_few_points_are_refused():
    with pytest.raises(DrakeTrackerError, match="only 100 points were found"):
        fit_speed([laps(made(), cycles=100)], PIXEL)


def test_a_file_gives_back_what_was_saved(tmp_path):
    path = tmp_path / "vision.yaml"
    error = made(pattern=3e-4, missing=(0.05, 2.0))
    save_error(path, error, rig={"fov_deg": 30.0}, notes={"seeds": 2})
    loaded = load_error(path, rig={"fov_deg": 30.0})
    for name in ("speeds", "bias", "pattern", "jitter", "missing", "pixel", "seen_from"):
        assert getattr(loaded, name) == pytest.approx(getattr(error, name), abs=1e-7), name


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("speed: 0.1\n", "speed: .nan\n", r"speeds\[0\].speed must be a finite number"),
        ("speed: 0.1\n", "speed: 0.3\n", "speeds must increase"),
        ("missing_share: 0.0", "missing_share: 1.5", "missing_share must be at most 1"),
        ("pattern: [", "pattern: [x, ", r"speeds\[0\].pattern must be 3 finite numbers"),
        ("bias_straight:", "bias_other:", "bias_straight must be a mapping with along, across, vertical"),
        ("fov_deg: 30.0", "fov_deg: 20.0", "made with rig.fov_deg = 20.0, but the scenario's cameras have 30.0"),
        ("seen_from: ", "seen_from: -", "seen_from must be a finite number from 0"),
        ("speeds:", "speeds: [", "this is not YAML"),
        ("speeds:", "fast:", "speeds must be a list"),
    ],
)
def test_a_broken_file_is_one_line(tmp_path, old, new, said):
    path = tmp_path / "vision.yaml"
    save_error(path, made(), rig={"fov_deg": 30.0}, notes={})
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(DrakeTrackerError, match=said) as caught:
        load_error(path, rig={"fov_deg": 30.0})
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


def test_a_missing_file_says_how_to_make_one(tmp_path):
    with pytest.raises(DrakeTrackerError, match="drake-tracker measure"):
        load_error(tmp_path / "none.yaml")
