import numpy as np
import pytest
from measure import COLUMNS, HORIZONS, run_cell
from replay import BLOCK, Recording
from tables import Cell, merged, paired_ratio
from worlds import NOISES, draw_noise

SIGMA = 0.001


@pytest.fixture(scope="module")
def recording():
    return Recording.load()


@pytest.mark.parametrize("kind", NOISES)
def test_every_noise_has_the_standard_deviation_asked_for(kind, recording):
    yaw = np.tile(np.linspace(0.0, 2.0 * np.pi, 1200), 10)
    error = draw_noise(kind, SIGMA, yaw, np.random.default_rng(0), recording)
    assert error.shape == (12000, 3)
    assert np.sqrt(np.mean(error[:, :2] ** 2)) == pytest.approx(SIGMA, rel=0.1)


def test_replayed_errors_were_recorded_at_such_a_heading():
    stamps = np.arange(2000) / 60.0
    yaw = np.linspace(0.0, 4.0 * np.pi, 2000)
    errors = np.column_stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw])  # an error that tells its heading
    recorded = Recording(stamps, yaw, errors)
    wanted = np.linspace(1.0, 3.0, 600)
    drawn = recorded.draw(wanted, recorded.rms, np.random.default_rng(0))
    away = np.angle(np.exp(1j * (np.arctan2(drawn[:, 1], drawn[:, 0]) - wanted)))
    assert np.max(np.abs(away)) < np.radians(15.0)


def test_no_block_is_taken_across_a_gap():
    stamps = np.arange(100) / 60.0
    stamps[50:] += 1.0
    recorded = Recording(stamps, np.zeros(100), np.arange(300.0).reshape(100, 3))
    drawn = recorded.draw(np.zeros(BLOCK * 50), recorded.rms, np.random.default_rng(0))[:, 0] / 3.0
    blocks = drawn.reshape(-1, BLOCK)
    np.testing.assert_allclose(np.diff(blocks, axis=1), 1.0)
    assert not np.any((blocks[:, 0] < 50) & (blocks[:, -1] >= 50))


def test_a_paired_ratio_is_blind_to_what_runs_share():
    shared = np.random.default_rng(0).uniform(1.0, 100.0, 20)
    ratio, (low, high) = paired_ratio(1.21 * shared, shared)
    assert (ratio, low, high) == pytest.approx((1.1, 1.1, 1.1))


def test_a_run_of_a_cell_holds_errors_and_bounds_of_every_stage():
    found = run_cell("circle", "white", 1, "constant", 1000, 12.0, ("coordinated_turn",), {})
    cell = Cell([{"seed": 1000, **found}])
    assert set(found["bounds"]) == {"floor", "first_lap", "closed_path"}
    for horizon in HORIZONS:
        assert 0.0 < cell.rms("coordinated_turn", ("first", "between", "after"), horizon) < 20.0
        # An extrapolation is above what one who is told of the track's only bend can reach, to chance.
        square = cell.values("coordinated_turn", ("first",), horizon, COLUMNS[1])
        assert square[0] > 0.3 * cell.bound("first_lap", horizon)[0]


def test_a_renewed_contestant_takes_the_place_of_its_old_results_and_leaves_the_others():
    old = {"cell": "a", "seed": 1, "results": {"x": 1, "y": 2}, "bounds": {"b": 3}, "commit": "one"}
    other = {"cell": "moved", "seed": 1, "trial": {"n": 1}, "commit": "one"}
    new = {"cell": "a", "seed": 1, "only": "y", "results": {"y": 5}, "bounds": {"b": 3}, "commit": "two"}
    newer = new | {"results": {"y": 6}, "commit": "three"}
    first, second = merged([old, other, new, newer])
    assert first["results"] == {"x": 1, "y": 6} and first["bounds"] == {"b": 3}
    assert [(made["only"], made["commit"]) for made in first["made_by"]] == [(None, "one"), ("y", "three")]
    assert second["trial"] == {"n": 1} and "results" not in second
