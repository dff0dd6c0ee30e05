"""The benchmark of the conveyor's cameras: its scenarios can be loaded, and its lines become a table."""

import conveyor_vision as benchmark
import pytest
from shared import parts

from drake_tracker.tasks import load_scenario

ERRORS = {
    "measurements": 100, "parts": 2, "bias_m": 0.001, "noise_m": 0.002, "turn_bias_rad": None, "turn_noise_rad": None,
    "largest_m": 0.004, "wrong_kind": 1, "identities_lost": 0,
}  # fmt: skip
NONE = {"measurements": 0, "parts": 0}


def test_every_cell_can_be_loaded():
    for overrides in benchmark.CELLS.values():
        load_scenario("conveyor", overrides=overrides)


def test_runs_are_pooled_by_parts_and_measurements():
    more = {**ERRORS, "parts": 6, "measurements": 300, "bias_m": 0.002, "noise_m": 0.0, "largest_m": 0.01}
    found = benchmark.pooled([ERRORS, more, NONE])
    assert (found["parts"], found["measurements"], found["wrong_kind"], found["largest_m"]) == (8, 400, 2, 0.01)
    assert found["bias_m"] == pytest.approx((2 * 0.001**2 + 6 * 0.002**2) ** 0.5 / 8**0.5)
    assert found["noise_m"] == pytest.approx(0.001) and found["turn_noise_rad"] is None


def test_lines_become_a_table_with_a_row_for_each_kind():
    lines = [{"cell": "0.10 m/s", "seed": 1, "kinds": {"box": ERRORS, "disc": NONE, "ell": ERRORS}}]
    header, rows = benchmark.vision_table(parts.of_cells(lines, benchmark.summary))
    assert [row[1] for row in rows] == ["box", "disc", "ell"] and all(len(row) == len(header) for row in rows)
    assert "1.00 mm" in rows[0] and "1 of 100" in rows[0] and rows[1][2] == 0
