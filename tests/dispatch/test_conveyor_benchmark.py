"""The benchmark of the conveyor: its scenarios can be loaded, and its lines become tables."""

import conveyor
import numpy as np
import pytest
from shared import parts

from drake_tracker.core.log import Signal
from drake_tracker.world.conveyor.conveyor_config import BeltConfig
from drake_tracker.world.conveyor.part_fates import PartFate

LINE = {
    **dict.fromkeys(conveyor.KEPT, 0),
    "success": True,
    "arrived": 9,
    "could_be_picked": 8,
    "placed_of_these": 7,
    "picked": 8,
    "placed": 8,
    "picks_per_minute": 12.0,
    "share_of_clairvoyant": None,
    "placement_rms_m": 0.002,
    "placement_turn_rms_rad": None,
    "missed_because": {"not chosen": 1},
}


def test_every_cell_can_be_loaded_and_named_on_the_command_line():
    assert conveyor.available(conveyor.CELLS) == list(conveyor.CELLS)
    assert not any("," in cell for cell in conveyor.CELLS), "--cells separates cells by commas"


@pytest.mark.parametrize("name", [name for name, part in conveyor.PARTS.items() if isinstance(part, parts.Part)])
def test_every_part_has_a_table_of_its_lines(name):
    part = conveyor.PARTS[name]
    cell = next(iter(part.cells))
    lines = [{"cell": cell, "seed": seed, **LINE} for seed in (1, 2)]
    results = parts.of_cells(lines, part.summary)
    assert results[0]["lost"][:2] == [2, 16] and results[0]["missed_because"] == {"not chosen": 2}
    header, (row,) = part.table(results)
    assert len(row) == len(header) and "12.0" in row


def test_all_seeds_are_in_their_range():
    for part in conveyor.PARTS.values():
        seeds = (
            [part.seed]
            if isinstance(part, parts.Timed)
            else range(part.first_seed, part.first_seed + max(part.cells.values()))
        )
        assert min(seeds) >= 5000 and max(seeds) < 5500


def test_speeds_are_compared_with_the_default_at_the_mean_number_of_parts_in_view():
    times = np.arange(9.0, 12.0)
    states = np.zeros((3, 26))
    states[:, 5], states[:, 18] = [-2.0, -0.4, 0.0], [0.0, 0.4, 0.6]
    fates = np.array([[PartFate.UPSTREAM, PartFate.ON_BELT]] * 3, float)
    log = {
        "truth_part_states": Signal(times, states, tuple("ab" * 13)),
        "truth_fates": Signal(times, fates, ("a", "b")),
    }
    assert conveyor.in_view(log, BeltConfig()) == 1.5  # two parts at 10 s, one at 11 s
    cells = [{"cell": name, "real_time_factor": factor, "in_view": 5.9} for name, factor in (("a", 0.9), ("b", 1.8))]
    header, rows = conveyor.PARTS["speed"].table(cells)
    assert len(header) == len(rows[0]) and rows[1] == ["b", "5.9", "1.80", "2.00"]
    for name, settings in conveyor.SPEED.values():
        conveyor.load_scenario(name, overrides=settings)
