"""The grid of a campaign: combinations of settings, and errors before anything runs."""

import pytest

from drake_tracker.campaign.grid import make_cells, parse_vary, plain_value, split_values, yaml_text
from drake_tracker.campaign.plan import make_plan
from drake_tracker.core.errors import DrakeTrackerError


@pytest.mark.parametrize(
    "text, values",
    [
        ("0.1,0.2", ["0.1", "0.2"]),
        (" a , b", ["a", "b"]),
        ("!ArcLength {order: 9, mode: literal},!A {}", ["!ArcLength {order: 9, mode: literal}", "!A {}"]),
        ("[0.5, 0.0],[0.6, 0.0]", ["[0.5, 0.0]", "[0.6, 0.0]"]),
        ("'a,b',\"c,d\"", ["'a,b'", '"c,d"']),
        ("1,,2", ["1", "", "2"]),
        ("!ArcLength,!ClosedPath {},!A", ["!ArcLength", "!ClosedPath {}", "!A"]),
        ("", [""]),
    ],
)
def test_values_are_split_at_top_level_commas(text, values):
    assert split_values(text) == values


def test_every_combination_is_a_cell_with_its_scenario():
    vary = parse_vary(["track.speed=0.1,0.2", "track.kind=oval,circle,stadium"])
    cells = make_cells("train:learned", ["duration=5"], vary)
    assert [cell.settings["track.speed"] for cell in cells] == ["0.1"] * 3 + ["0.2"] * 3
    assert [cell.scenario.track.kind for cell in cells] == ["oval", "circle", "stadium"] * 2
    assert [cell.scenario.track.speed for cell in cells] == [0.1] * 3 + [0.2] * 3
    assert {cell.scenario.duration for cell in cells} == {5.0}


def test_without_a_grid_there_is_one_cell():
    (cell,) = make_cells("ball", [], {})
    assert cell.settings == {} and cell.scenario.task == "ball"


@pytest.mark.parametrize(
    "texts, said",
    [
        (["track.speed"], ["--vary track.speed: write it as key.path=a,b,c"]),
        (["track.speed=1", "track.speed=2"], ["track.speed is varied twice"]),
        (["track.sped=0.1,0.2"], ["--vary track.sped=0.1: there is no", "--vary track.sped=0.2: there is no"]),
        (["track.speed=0.1,9"], ["--vary track.speed=9: track.speed must be a number from 0 to 1 m/s, not 9"]),
        (["track.speed=0.1,,0.2"], ["--vary track.speed: a value is empty"]),
        (["track.kind=oval,'circle"], ["--vary track.kind=oval,'circle: not valid YAML"]),
        (["track.speed=0.1,0.1"], ["--vary track.speed: 0.1 is given twice"]),
        (["seed=1,2"], ["--vary seed: every trial has a seed of its own"]),
        (["estimator=!Arc {}"], ["--vary estimator=!Arc {}: estimator must be one of"]),
        (["time_step=0.004"], ["--vary time_step=0.004: time_step must divide the image", "must divide the servo"]),
    ],
)
def test_bad_grids_are_one_line_each(texts, said):
    with pytest.raises(DrakeTrackerError) as caught:
        make_cells("train:learned", [], parse_vary(texts))
    lines = str(caught.value).splitlines()
    assert len(lines) == len(said), lines
    assert all(words in line for words, line in zip(said, lines))


def test_an_error_in_many_cells_is_reported_once():
    with pytest.raises(DrakeTrackerError) as caught:
        make_cells("train:learned", [], parse_vary(["track.speed=9", "track.kind=oval,circle,line"]))
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    "arguments, said",
    [
        ({"trials": 0}, "--trials 0"),
        ({"trials": 10**9}, "--trials 1000000000: at most 100000 are allowed"),
        (
            {"vary": {"track.speed": list(range(400)), "seed_of": list(range(400))}},
            "--vary: 160000 combinations; at most 10000 are allowed",
        ),
        ({"first_seed": -1}, "--first-seed -1: seed must be"),
        ({"first_seed": 2**32 - 1, "trials": 2}, f"the last seed {2**32}: seed must be"),
        ({"overrides": ["seed=3"]}, "--set seed=3: every trial has a seed of its own"),
        ({"vision": "felt"}, "--vision felt: must be one of measured"),
        ({"spec": "ball", "vision": "measured"}, "--vision measured: vision must be one of !BoardVision"),
        ({"spec": "trian"}, "did you mean train?"),
    ],
)
def test_bad_plans_are_one_line(arguments, said):
    with pytest.raises(DrakeTrackerError) as caught:
        make_plan(**{"spec": "train", "trials": 1, **arguments})
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_trials_run_seed_by_seed_and_measured_vision_has_settings():
    plan = make_plan("train:learned", 2, {"track.speed": [0.1, 0.2]}, ["vision.lag_cycles=6"], 7, "measured")
    assert [(t.scenario.seed, t.scenario.track.speed) for t in plan.jobs()] == [(7, 0.1), (7, 0.2), (8, 0.1), (8, 0.2)]
    assert {type(t.scenario.vision).__name__ for t in plan.jobs()} == {"Measured"}
    assert {t.scenario.vision.lag_cycles for t in plan.jobs()} == {6}
    assert len({t.key for t in plan.jobs()}) == len(plan) == 4


@pytest.mark.parametrize(
    "value, text", [(0.2, "0.2"), (3, "3"), (True, "true"), ([0.5, 1.0], "[0.5, 1.0]"), ("x y", "x y")]
)
def test_python_values_are_written_as_yaml(value, text):
    assert yaml_text(value) == text


def test_numeric_texts_are_read_as_numbers():
    assert [plain_value(text) for text in ("0.20", "3", "1e-3", "false", "oval", "!ArcLength {}", "[1, 2]")] == [
        0.2,
        3,
        0.001,
        False,
        "oval",
        "!ArcLength {}",
        "[1, 2]",
    ]
