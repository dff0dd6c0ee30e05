"""The benchmark of the conveyor: its scenarios can be loaded, and its lines become tables."""

import conveyor
import parts
import pytest

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


@pytest.mark.parametrize("name", conveyor.PARTS)
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
        assert part.first_seed >= 5000 and part.first_seed + max(part.cells.values()) <= 5500
