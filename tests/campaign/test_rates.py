"""Rates and their intervals, the table, and the plots."""

import csv
import math

import pytest

from drake_tracker.campaign.plan import make_plan
from drake_tracker.campaign.plots import draw_rates
from drake_tracker.campaign.rates import Rate, rate_table, rates_of, wilson
from drake_tracker.campaign.table import columns_of, write_csv


@pytest.mark.parametrize(
    "successes, trials, low, high",
    [  # R. G. Newcombe, Statistics in Medicine 17 (1998), table I, method 3
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_agrees_with_published_values(successes, trials, low, high):
    found = wilson(successes, trials)
    assert found == pytest.approx((low, high), abs=5e-5)
    mirrored = wilson(trials - successes, trials)
    assert mirrored == pytest.approx((1 - high, 1 - low), abs=5e-5)


def test_wilson_without_trials_is_the_whole_range():
    assert wilson(0, 0) == (0.0, 1.0)


ROWS = [
    {"settings": {"track.speed": speed}, "seed": seed, "success": seed < taken, "failure_reason": None}
    for speed, taken in (("0.1", 4), ("0.2", 1))
    for seed in range(4)
]
CELLS = [{"track.speed": speed} for speed in ("0.1", "0.2", "0.3")]


def test_rates_are_counted_cell_by_cell():
    rates = rates_of(ROWS, CELLS)
    assert [(rate.successes, rate.trials) for rate in rates] == [(4, 4), (1, 4), (0, 0)]
    assert (rates[1].low, rates[1].high) == wilson(1, 4)
    assert rates[1].share == 0.25 and rates[2].share is None
    lines = [line.split() for line in rate_table(rates, ["track.speed"])]
    assert lines[1][:4] == ["0.1", "4", "4", "100"] and lines[3] == ["0.3", "0", "0"]
    assert lines[-1][:4] == ["all", "5", "8", "62"]


def test_the_table_has_settings_first_and_flattens_nested_values():
    rows = [
        {
            "settings": {"track.speed": "0.1", "track.kind": "oval"},
            "seed": 1,
            "wall_s": 2.5,
            "success": True,
            "failure_reason": None,
            "lag_s": {"min": 0.25, "max": 0.26},
            "error": [1.0, 2.0],
        },
        {
            "settings": {"track.speed": "0.2", "track.kind": "oval"},
            "seed": 1,
            "success": False,
            "failure_reason": "missed, twice",
            "hold_s": None,
        },
    ]
    table = columns_of(rows, ["track.speed", "track.kind"])
    assert list(table) == [
        "track.speed",
        "track.kind",
        "seed",
        "success",
        "failure_reason",
        "wall_s",
        "lag_s.min",
        "lag_s.max",
        "error.0",
        "error.1",
        "hold_s",
    ]
    assert table["track.speed"] == [0.1, 0.2] and table["lag_s.max"] == [0.26, None]


def test_the_csv_reads_back(tmp_path):
    columns = {"a": [1, None], "b": [True, False], "c": ['x, "y"', None], "d": [0.1 + 0.2, math.pi]}
    write_csv(columns, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(newline="") as file:
        header, first, second = csv.reader(file)
    assert header == ["a", "b", "c", "d"]
    assert first[:3] == ["1", "true", 'x, "y"'] and second[:3] == ["", "false", ""]
    assert [float(first[3]), float(second[3])] == [0.1 + 0.2, math.pi]
    assert [path.name for path in tmp_path.iterdir()] == ["t.csv"]


def rate(taken, **settings):
    return Rate({key.replace("_", "."): text for key, text in settings.items()}, taken, 10, *wilson(taken, 10))


def test_a_numeric_setting_is_drawn_as_a_line_with_intervals():
    plan_rates = [rate(2, track_speed="0.3"), rate(9, track_speed="0.1")]
    (axes,) = draw_rates(plan_rates, ["track.speed"], {"track.speed": "m/s"}).axes
    ((line, _, (bars,)),) = axes.containers
    assert list(line.get_xdata()) == [0.1, 0.3] and list(line.get_ydata()) == pytest.approx([90.0, 20.0])
    low, high = bars.get_segments()[0][:, 1]
    assert (low, high) == pytest.approx([100 * end for end in wilson(9, 10)])
    assert axes.get_xlabel() == "track.speed  [m/s]"


def test_a_setting_of_words_gives_one_line_per_word():
    rates = [rate(5, estimator=kind, track_speed=speed) for kind in ("!A {}", "!B {}") for speed in ("0.1", "0.2")]
    (axes,) = draw_rates(rates, ["estimator", "track.speed"]).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["estimator !A {}", "estimator !B {}"]


def test_a_single_setting_of_words_gives_points():
    (axes,) = draw_rates([rate(5, track_kind="oval"), rate(6, track_kind="line")], ["track.kind"]).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["oval", "line"]


def test_two_numeric_settings_give_a_map_with_white_empty_cells():
    rates = [rate(3, a_b=x, c_d=y) for x in ("1", "2") for y in ("10", "5")]
    rates[0] = Rate(rates[0].settings, 0, 0, 0.0, 1.0)
    axes, _ = draw_rates(rates, ["a.b", "c.d"]).axes
    data = axes.images[0].get_array()
    assert data.shape == (2, 2) and [label.get_text() for label in axes.get_yticklabels()] == ["5", "10"]
    assert data.mask.sum() == 1 and data.mask[1, 0]


def test_one_cell_gives_no_plot():
    assert draw_rates([Rate({}, 1, 2, *wilson(1, 2))], []) is None
    assert make_plan("train:learned", 1).vary == {}
