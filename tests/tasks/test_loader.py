"""Tests of reading, checking and writing scenarios, and of the messages about wrong ones."""

import dataclasses
import os
import re
import typing
import warnings

import pytest
import yaml

from drake_tracker.core.errors import DrakeTrackerError, DrakeTrackerWarning
from drake_tracker.core.setting import settings_of
from drake_tracker.estimation.config import AlphaBetaGamma, ArcLength, ClosedPath, CoordinatedTurn, InclinedPlane
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.link.config import Lossy, Perfect
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.scenarios.reader import setting_keys
from drake_tracker.scenarios.tree import RENAMED_TAGS, parse
from drake_tracker.tasks import list_scenarios, load_scenario, save_scenario, scenario_file, validate
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.train.scenario import Rendered, TrainScenario
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.silhouettes.config import SilhouetteTracker


def errors_of(*args, **kwargs):
    with pytest.raises(DrakeTrackerError) as caught:
        load_scenario(*args, **kwargs)
    return str(caught.value).splitlines()


def write(folder, text, name="mine.yaml"):
    path = folder / name
    path.write_text(text)
    return path


def all_parts(schema):
    yield schema
    for field in dataclasses.fields(schema):
        for kind in typing.get_args(field.type) or (field.type,):
            if dataclasses.is_dataclass(kind):
                yield from all_parts(kind)


def test_every_scenario_of_the_package_loads_and_is_described():
    listed = list_scenarios()
    assert [name for name, _ in listed][:1] == ["train"]
    assert {"train:interlaced", "train", "train:literal"} <= {name for name, _ in listed}
    for name, description in listed:
        assert load_scenario(name).name == name
        assert description


def test_every_scenario_can_be_written_and_read_again_also_by_drake(tmp_path):
    from pydrake.common.yaml import yaml_load

    for count, (name, _) in enumerate(list_scenarios()):
        scenario = load_scenario(name, seed=11, overrides=["link=!Lossy {drop: 0.2}"])
        path = tmp_path / f"resolved{count}.yaml"
        save_scenario(scenario, path)
        assert load_scenario(str(path)) == scenario
        data = yaml_load(filename=str(path), private=True)[path.stem]
        assert data["seed"] == 11 and data["link"] == {"_tag": "!Lossy"} | vars(scenario.link)


def test_every_setting_has_a_help_text_and_its_default_is_allowed():
    for part in (*all_parts(TrainScenario), *all_parts(BallScenario)):
        for field in settings_of(part):
            assert field.metadata["help"], f"{part.__name__}.{field.name}"
    for estimator in (ArcLength, AlphaBetaGamma, CoordinatedTurn, ClosedPath):
        for link in (Perfect, Lossy):
            validate(TrainScenario(estimator=estimator(), link=link()))


def test_a_scenario_is_frozen_and_can_be_copied_with_other_settings():
    scenario = load_scenario("train:learned", seed=4)
    with pytest.raises(dataclasses.FrozenInstanceError):
        scenario.seed = 5
    with pytest.raises(TypeError):
        scenario.track.semi_axes[0] = 9.0
    changed = scenario.with_settings({"seed": 5, "track.speed": 0.2, "track.centre": [0.5, 0.1]})
    assert (changed.seed, changed.track.speed, changed.track.centre) == (5, 0.2, (0.5, 0.1))
    assert (scenario.seed, scenario.track.speed) == (4, 0.15)
    assert changed.grasp is scenario.grasp and changed.origins == scenario.origins
    with pytest.raises(AttributeError, match="TrackConfig has no setting 'sped'"):
        scenario.with_settings({"track.sped": 0.2})


def test_interlaced_extends_learned():
    train, interlaced = load_scenario("train:learned"), load_scenario("train:interlaced")
    assert interlaced.vision.method.detector.preset == "paper_interlaced"
    assert interlaced.track.kind == "circle"
    assert interlaced.track.speed == 0.2
    assert interlaced.servo.stale_after == train.servo.stale_after


def test_overrides_replace_the_values_of_the_file_and_the_last_override_wins():
    overrides = ["track.speed=1e-1", "track.speed=0.2", "track={kind: stadium, radius: 0.1}", "vision.lag_cycles=12"]
    scenario = load_scenario("train:learned", seed=7, duration=12, overrides=overrides)
    assert (scenario.seed, scenario.duration) == (7, 12.0)
    assert isinstance(scenario.duration, float)
    assert (scenario.track.kind, scenario.track.radius, scenario.track.speed) == ("stadium", 0.1, 0.2)
    assert scenario.vision.lag_cycles == 12


def test_a_tag_chooses_the_kind_of_a_role():
    overrides = ["estimator=!AlphaBetaGamma", "link=!Lossy {drop: 0.1}", "link.burst=3"]
    scenario = load_scenario("train:learned", overrides=overrides)
    assert scenario.estimator == AlphaBetaGamma()
    assert scenario.link == Lossy(drop=0.1, burst=3)
    assert load_scenario(
        "train:learned", overrides=["vision.method.detector=!NormalFlow {stride: 2}"]
    ).vision.method.detector == NormalFlow(stride=2)


@pytest.mark.parametrize(
    "bare, tagged",
    [
        ("link=Lossy {drop: 0.3}", "link=!Lossy {drop: 0.3}"),
        ("estimator=CoordinatedTurn", "estimator=!CoordinatedTurn {}"),
        ("objects=[Ball {}, Hand]", "objects=[!Ball {}, !Hand {}]"),
        ("track.event=Stop {at: 3}", "track.event=!Stop {at: 3}"),
        (
            "vision={method: SilhouetteTracker {target: Coloured {colour: '#d0a050'}}}",
            "vision={method: !SilhouetteTracker {target: !Coloured {colour: '#d0a050'}}}",
        ),
        ("description=Lossy", "description='Lossy'"),
        ('description="Ball {}, Lossy"', "description='Ball {}, Lossy'"),
    ],
)
def test_an_override_may_omit_the_exclamation_mark_of_a_kind(bare, tagged):
    """An interactive shell replaces an exclamation mark, even in double quotes."""
    found, expected = (load_scenario("train:two", overrides=[override]) for override in (bare, tagged))
    assert dataclasses.replace(found, origins={}) == dataclasses.replace(expected, origins={})


@pytest.mark.parametrize("kind", ["Measured", "Rendered"])
def test_a_new_kind_of_vision_keeps_the_work_volume_and_the_lag(kind):
    scenario = load_scenario("train:line", overrides=["vision.lag_cycles=9", f"vision=!{kind} {{}}"])
    assert type(scenario.vision).__name__ == kind
    assert scenario.vision.work_volume == ((0.44, -0.50, 0.45), (0.68, 0.50, 0.51))
    assert scenario.vision.outline == "box" and scenario.vision.lag_cycles == 9
    assert "train.yaml line" in scenario.where("vision.outline")
    own = load_scenario("train:line", overrides=[f"vision=!{kind} {{outline: ellipse}}"])
    assert own.vision.outline == "ellipse" and own.vision.work_volume == scenario.vision.work_volume
    later = load_scenario(
        "train:line", overrides=["vision=!Measured {}", f"vision=!{kind} {{}}", "vision.lag_cycles=8"]
    )
    assert later.vision.outline == "box" and later.vision.lag_cycles == 8


def test_a_new_tag_discards_the_settings_of_the_base_kind(tmp_path):
    path = write(
        tmp_path,
        "mine: {base: train:learned, estimator: !ArcLength {order: 20}}\n"
        "same: {base: mine, estimator: {mode: literal}}\n"
        "other: {base: mine, estimator: !AlphaBetaGamma {}}\n",
    )
    assert load_scenario(f"{path}:same").estimator == ArcLength(order=20, mode="literal")
    assert load_scenario(f"{path}:other").estimator == AlphaBetaGamma()


def test_an_empty_value_restores_the_value_of_the_preset():
    for empty in ("", "null"):
        overrides = ["vision.method.detector.stride=1", f"vision.method.detector.stride={empty}"]
        assert load_scenario("train:learned", overrides=overrides).vision.method.detector.stride is None


def test_all_errors_are_reported_at_once_with_line_key_value_and_allowed_values(tmp_path):
    path = write(
        tmp_path,
        "mine:\n"
        "  track:\n"
        "    speed: fast\n"
        "    semi_axes: [0.1]\n"
        "    knid: oval\n"
        "  cameras:\n"
        "    noise: .nan\n"
        "  estimator: !ArcLenght {}\n",
    )
    errors = errors_of(str(path), overrides=["grasp.gate=sometimes"])
    assert errors == [
        f"{path} line 3: track.speed must be a number from 0 to 1 m/s, not 'fast'",
        f"{path} line 4: track.semi_axes must be a list of 2 numbers from 0.03 to 1 m, not [0.1]",
        f"{path} line 5: there is no setting track.knid; did you mean track.kind?",
        f"{path} line 7: cameras.noise must be a number from 0 to 64 grey levels, not nan",
        f"{path} line 8: estimator must be one of !ClosedPath, !CoordinatedTurn, !ArcLength, !AlphaBetaGamma, "
        "!Custom, not !ArcLenght; did you mean !ArcLength?",
        "--set grasp.gate=sometimes: grasp.gate must be one of probability, auto, memory, recent, not 'sometimes'",
    ]


@pytest.mark.parametrize(
    "override, message",
    [
        ("track.speeed=1", "did you mean track.speed?"),
        ("preset=scaled", "did you mean vision.method.detector.preset?"),
        ("link.drop=0.1", "no setting link.drop in !Perfect; it belongs to link: !Lossy"),
        ("estimator=ArcLenght", "estimator must be one of !"),
        ("link=Lossi {drop: 0.1}", "not !Lossi; did you mean !Lossy?"),
        ("zzzz=1", "a scenario has task, name, description, duration"),
        ("track=3", "track must be a mapping of settings, not 3"),
        ("track.speed=.inf", "a number from 0 to 1 m/s, not inf"),
        ("track.speed=true", "a number from 0 to 1 m/s, not true"),
        ("track.speed=" + "9" * 400, "a number from 0 to 1 m/s, not 999"),
        ("track.speed={}", "not a mapping"),
        ("track.speed=!x 3", "not !x '3'"),
        ("track.speed=null", "not empty"),
        ("track.speed=", "not empty"),
        ("track.centre=[{a: 1}, 2]", "not [{'a': 1}, 2]"),
        ("track.centre=[0.5, .nan]", "a list of 2 numbers from -2 to 2 m, not [0.5, nan]"),
        ("vision.work_volume=[[0, 0, 0]]", "a list of 2 lists of 3 numbers"),
        ("vision.work_volume=[[1, 1, 1], [0, 0, 0]]", "lowest corner first"),
        ("vision.lag_cycles=1.5", "a whole number from 1 to 120 cycles, not 1.5"),
        ("lighting.shadows=1", "true or false, not 1"),
        ("track.kind=ovla", "did you mean oval?"),
        ("track.kind=csv", "track.csv (default) must name a file when track.kind is csv"),
        ("track.csv=some.csv", "track.kind (default) must be csv"),
        ("track.start=-0.5", "a fraction from 0 to 1"),
        ("time_step=0.003", "must divide the image period"),
        ("cameras.azimuth_deg=[10, 10]", "no baseline"),
        ("track={speed: 0.1, speed: 0.2}", "speed is given twice"),
        ("seed=[", "not valid YAML"),
        ("seed=&a [*a]", "not valid YAML"),
        ("seed=!!bool maybe", "not valid YAML: 'maybe' is not a value of the type !!bool"),
        ("seed=!!int ''", "not valid YAML: '' is not a value of the type !!int"),
        ("seed=" + "[" * 60 + "]" * 60, "not valid YAML: nested too deeply, more than 32 levels"),
        ("a." * 100 + "a=1", "write it as key.path=value"),
        ("track={[1]: 2}", "a key must be a name, not a list or mapping"),
        ('description="a\\x1b]0;b"', "description must be text without control characters, not 'a\\x1b]0;b'"),
        ('description="\\ud800"', "description must be text without control characters"),
        ("track.csv=" + "a" * 300, "track.kind (default) must be csv"),
        ("seed=!!python/object:os.system x", "seed must be a whole number"),
        ("description=a\x1bb", "not valid YAML: unacceptable character #x001b"),
        ("task=[ball]", "task must be"),
        ("seed", "write it as key.path=value"),
        ("track..speed=1", "write it as key.path=value"),
    ],
)
def test_a_wrong_override_gives_one_line_that_names_it(override, message):
    (error,) = errors_of("train:learned", overrides=[override])
    assert message in error
    assert f"--set {override}" in error or "(default)" in error


def test_duplicate_keys_are_rejected_with_both_lines(tmp_path):
    path = write(tmp_path, "mine:\n  seed: 1\n  track: {speed: 0.1}\n  seed: 2\nmine: {}\n")
    errors = errors_of(str(path))
    assert errors == [
        f"{path} line 4: mine.seed is given twice, first at {path} line 2; keep one",
        f"{path} line 5: mine is given twice, first at {path} line 1; keep one",
    ]


@pytest.mark.parametrize(
    "spec, message",
    [
        ("train:", "train: the name of a scenario is missing after the colon"),
        ("trian", "no scenario 'trian'; allowed are train, train:learned, train:guided, train:interlaced"),
        ("trian", "did you mean train?"),
        ("train:lerned", "did you mean learned?"),
        ("train_cameras", "there is no scenario"),
        ("nowhere/mine.yaml", "there is no scenario file nowhere/mine.yaml"),
        ("", "there is no scenario"),
    ],
)
def test_an_unknown_scenario_gives_one_line_with_the_nearest_name(spec, message):
    (error,) = errors_of(spec)
    assert message in error


@pytest.mark.parametrize(
    "text, message",
    [
        ("mine: [", "line 1: not valid YAML"),
        ("mine: {}\f", "line 1: not valid YAML: unacceptable character #x000c"),
        ("- 1\n", "must be a mapping from names to scenarios"),
        ("", "must be a mapping from names to scenarios"),
        ("mine: 3\n", "line 1: scenario 'mine' must be a mapping"),
        ("mine: {base: other}\nnext: {}", "line 1: base must be one of next, train, train:learned, train:guided, "),
        ("mine: {base: 'train:tow'}\n", "not 'train:tow'; did you mean train:two?"),
        ("mine: {base: 'trian'}\n", "not 'trian'; did you mean train?"),
        ("mine: {base: 'elsewhere.yaml:two'}\n", "line 1: base must be one of train, "),
        ("mine: {base: [other]}\n", "line 1: base must be one of train, "),
        ("mine: {base: mine}\n", "line 1: base must not lead back to 'mine': mine, mine extend each other"),
        (
            "mine: {base: next}\nnext: {base: mine}\n",
            "line 2: base must not lead back to 'mine': mine, next, mine extend each other",
        ),
        ("one: {}\ntwo: {}\n", "add a colon and the name of a scenario: one, two"),
        ("mine: {cameras: {width: 0}}\n", "line 1: cameras.width must be a whole number from 16 to 2048 px, not 0"),
    ],
)
def test_a_broken_file_gives_one_line_that_names_it(tmp_path, text, message):
    path = write(tmp_path, text)
    (error,) = errors_of(str(path))
    assert error.startswith(str(path)) and message in error


def test_a_file_cannot_exhaust_memory_time_or_stack(tmp_path):
    bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefgh", "bcdefghi")
    )
    path = write(tmp_path, f"{bomb}mine: {{seed: *i}}\n")
    assert errors_of(str(path)) == [f"{path} line 6: not valid YAML: more than 100000 values, aliases included"]
    path = write(tmp_path, f"mine: {{seed: {'[' * 300}{']' * 300}}}\n")
    assert errors_of(str(path)) == [f"{path} line 1: not valid YAML: nested too deeply, more than 32 levels"]
    path = write(tmp_path, "mine: {}\n" + "#" * 256 * 1024)
    assert errors_of(str(path)) == [f"{path}: cannot be read: it has more than 256 KiB"]
    path = write(tmp_path, "".join(f"s{k}: {{base: s{k + 1}}}\n" for k in range(400)) + "s400: {}\n")
    assert errors_of(f"{path}:s0") == [f"{path} line 51: more than 50 scenarios extend each other in a row"]
    path = write(tmp_path, "mine:\n" + "".join(f"  unknown{k}: 1\n" for k in range(3000)))
    *errors, last = errors_of(str(path))
    assert len(errors) == 100 and last == "and 2900 more errors"
    (line,) = errors_of("train:learned", overrides=[f"{'a' * 100_000}=1"])
    assert len(line) < 1000
    os.mkfifo(tmp_path / "pipe.yaml")
    assert errors_of(str(tmp_path / "pipe.yaml")) == [f"there is no scenario file {tmp_path / 'pipe.yaml'}"]
    assert errors_of("train:learned", overrides=["track.kind=csv", f"track.csv={'a' * 300}"])[0].endswith("a" * 300)


def test_files_are_searched_for_next_to_the_scenario_or_in_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    track = write(tmp_path, "x,y\n", "track.csv")
    path = write(tmp_path, "mine: {base: train:learned, track: {kind: csv, csv: track.csv}}\n")
    monkeypatch.chdir(tmp_path / "here")
    assert load_scenario(str(path)).track.csv == str(track)
    assert load_scenario("train:learned", overrides=["track.kind=csv", "track.csv=../track.csv"]).track.csv == str(
        track
    )
    (error,) = errors_of("train:learned", overrides=["track.kind=csv", "track.csv=track.csv"])
    assert "--set track.csv=track.csv: track.csv: there is no file" in error
    assert scenario_file(load_scenario("train:learned").cameras.calibration).name == "train_cameras.yaml"
    assert scenario_file(str(track)) == track


def test_the_origin_of_a_setting():
    scenario = load_scenario("train:interlaced", overrides=["track.radius=0.11"])
    assert scenario.where("track.radius") == "--set track.radius=0.11: track.radius"
    assert scenario.where("track.centre") == "track.centre (default)"
    with open(scenario_file("train.yaml"), encoding="utf-8") as file:
        lines = file.read().splitlines()
    origin, _, key = scenario.where("vision.method.detector.preset").partition(": ")
    assert key == "vision.method.detector.preset"
    assert "paper_interlaced" in lines[int(origin.rsplit(" ", 1)[1]) - 1]


def test_a_scenario_changed_in_python_can_be_checked():
    scenario = TrainScenario().with_settings({"track.speed": float("nan"), "track.centre": [0.5]})
    with pytest.raises(DrakeTrackerError) as caught:
        validate(scenario)
    assert len(str(caught.value).splitlines()) == 2
    assert "scenario: track.speed must be a number from 0 to 1 m/s, not nan" in str(caught.value)


def test_the_default_is_the_default_scenario_of_the_package():
    """The file contains only what differs from the defaults: TrainScenario() equals the scenario "train"."""
    train = load_scenario("train")
    assert dataclasses.replace(train, name="", description="") == TrainScenario()


def test_keys_are_plain_yaml():
    keys = list(setting_keys(TrainScenario))
    assert "track.speed" in keys and "link.drop" in keys and "estimator.order" in keys
    assert yaml.safe_load(yaml.safe_dump(keys)) == keys


def test_a_scenario_may_extend_one_of_the_package(tmp_path):
    path = write(
        tmp_path,
        "mine: {base: 'train:visitor', track: {speed: 0.2}}\n"
        "plain: {base: train, seed: 3}\n"
        "catch: {base: 'ball:seven_joint', duration: 9.0}\n"
        "above: {base: mine, seed: 4}\n",
    )
    mine, visitor = load_scenario(str(path)), load_scenario("train:visitor")
    assert mine.with_settings({"track.speed": 0.15, "name": visitor.name}) == visitor
    assert (mine.track.speed, mine.name) == (0.2, "mine")
    assert mine.where("objects").startswith("train.yaml line ")
    with pytest.warns(DrakeTrackerWarning, match="plain rests on"):
        plain = load_scenario(f"{path}:plain")
    assert plain.with_settings({"seed": 0, "name": "train"}) == load_scenario("train")
    assert load_scenario(f"{path}:catch").arm == load_scenario("ball:seven_joint").arm
    assert load_scenario(f"{path}:above").objects == visitor.objects


def test_a_base_in_the_same_file_comes_before_one_of_the_package(tmp_path):
    path = write(
        tmp_path, "train: {base: train:learned, seed: 7}\nmine: {base: train}\npackaged: {base: 'train:two'}\n"
    )
    assert load_scenario(f"{path}:mine").seed == 7
    assert load_scenario(f"{path}:packaged").seed == 0


def test_a_file_is_read_as_it_is_now_and_overrides_do_not_stay(tmp_path):
    path = write(tmp_path, "mine: {base: train:learned, track: {speed: 0.1}}\n")
    first = load_scenario(str(path))
    assert load_scenario(str(path), overrides=["track.speed=0.3", "seed=8"]).track.speed == 0.3
    assert load_scenario(str(path)) == first and first.track.speed == 0.1
    write(tmp_path, "mine: {base: train:learned, track: {speed: 0.2}}\n")
    assert load_scenario(str(path)).track.speed == 0.2
    other = write(tmp_path, "mine: {base: train:learned, track: {sped: 0.2}}\n", "other.yaml")
    renamed = write(tmp_path, other.read_text(), "renamed.yaml")
    for file in (other, renamed, renamed):
        assert errors_of(f"{file}:mine")[0].startswith(f"{file} line 1: there is no setting track.sped")


FORMER_NAMES = [("train:paper", "train"), ("train:blind", "train:learned")]
CHANGED = "rests on the defaults of train, which have changed; write base: train:guided for the former ones"


def warned_of(spec, **options):
    """Returns the scenario and the lines of the warnings of the package."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scenario = load_scenario(str(spec), **options)
    return scenario, [str(each.message) for each in caught if issubclass(each.category, DrakeTrackerWarning)]


def renamed(scenario, name):
    """Returns a scenario with the name and the description of one of the package, which do not change a run."""
    return scenario.with_settings({"name": name, "description": load_scenario(name).description})


@pytest.mark.parametrize("former, name", FORMER_NAMES)
def test_a_former_name_loads_the_scenario_and_warns_in_one_line_with_the_new_name(former, name):
    with pytest.warns(DrakeTrackerWarning) as caught:
        scenario = load_scenario(former, seed=3)
    assert [str(each.message) for each in caught] == [f"{former} is now called {name}"]
    assert caught[0].filename == __file__
    assert scenario == load_scenario(name, seed=3) and scenario.name == name


@pytest.mark.parametrize("former, name", FORMER_NAMES)
def test_a_file_may_extend_a_former_name(tmp_path, former, name):
    path = write(tmp_path, f"mine:\n  seed: 3\n  base: {former}\n")
    scenario, lines = warned_of(path)
    assert lines == [f"{path} line 3: {former} is now called {name}"]
    assert renamed(scenario, name) == load_scenario(name, seed=3)


def test_a_former_name_may_be_the_name_of_an_own_scenario(tmp_path):
    path = write(tmp_path, "mine: {base: 'train:blind'}\n'train:blind': {base: 'train:two', seed: 7}\n")
    scenario, lines = warned_of(f"{path}:mine")
    assert lines == [] and scenario.seed == 7 and scenario.objects == load_scenario("train:two").objects


@pytest.mark.parametrize("former, tag", RENAMED_TAGS.items())
def test_a_former_tag_means_the_present_one_and_warns_in_one_line_with_the_new_name(tmp_path, former, tag):
    errors = []
    with pytest.warns(DrakeTrackerWarning) as caught:
        tree = parse(f"part: !{former} {{}}\n", lambda line: f"mine.yaml line {line}", errors)
    assert [str(each.message) for each in caught] == [f"mine.yaml line 1: part: !{former} is now called !{tag}"]
    assert errors == [] and tree.find("part").tag == tag


def test_the_settings_of_a_former_tag_are_read(tmp_path):
    path = write(tmp_path, "mine:\n  base: ball\n  estimator: !Slope {sigma: 0.003}\n")
    scenario, lines = warned_of(path)
    assert lines == [f"{path} line 3: mine.estimator: !Slope is now called !InclinedPlane"]
    assert scenario.estimator == InclinedPlane(sigma=0.003)


@pytest.mark.parametrize(
    "text",
    [
        "mine: {base: train, seed: 3}\n",
        "mine: {seed: 3}\n",
        "mine: {task: train, seed: 3}\n",
        "mine: {base: own}\nown: {base: train, seed: 3}\n",
        "mine: {base: own}\nown: {seed: 3}\n",
        "mine: {base: train}\ntrain: {seed: 3}\n",
        "mine: {seed: 3}\n'train:guided': {base: train}\n",
    ],
)
def test_a_file_that_rests_on_the_defaults_that_changed_warns_in_one_line(tmp_path, text):
    path = write(tmp_path, text)
    scenario, lines = warned_of(path)
    assert lines == [f"{path}: mine {CHANGED}"]
    assert renamed(scenario, "train") == load_scenario("train", seed=3)


def test_the_base_that_the_warning_names_restores_the_former_defaults(tmp_path):
    """The settings of the default scenario before `train` became the system of 1991."""
    path = write(tmp_path, "mine: {base: train:guided}\n")
    scenario, lines = warned_of(path)
    assert lines == []
    assert scenario.estimator == ClosedPath() and scenario.vision.method == SilhouetteTracker()
    assert scenario.vision.outline == "box"
    assert (scenario.grasp.descent, scenario.grasp.gate, scenario.grasp.lift_height) == ("guided", "probability", 0.18)
    rest = {"estimator": ArcLength(), "vision": Rendered(), "grasp": GraspConfig(), "name": "", "description": ""}
    assert scenario.with_settings(rest) == TrainScenario()


@pytest.mark.parametrize(
    "text, name",
    [
        ("mine: {base: train:guided}\n", "train:guided"),
        ("mine: {base: train:learned}\n", "train:learned"),
        ("mine: {base: train:two}\n", "train:two"),
        ("mine: {base: ball}\n", "ball"),
        ("mine: {task: ball}\n", "ball"),
        ("mine: {base: conveyor}\n", "conveyor"),
        ("mine: {base: own}\nown: {base: train:learned}\n", "train:learned"),
    ],
)
def test_a_file_whose_meaning_is_as_before_does_not_warn(tmp_path, text, name):
    scenario, lines = warned_of(write(tmp_path, text))
    assert lines == []
    assert renamed(scenario, name) == load_scenario(name)


def test_a_file_that_gives_each_setting_that_changed_does_not_warn(tmp_path):
    settings = (
        "estimator: !ArcLength {}, vision: {method: {}, outline: ellipse}, "
        "grasp: {descent: blind, gate: auto, lift_height: 0.15}"
    )
    for base in ("base: train, ", ""):
        tracker = settings if not base else settings.replace("method: {}", "method: !MotionCentroid {}")
        path = write(tmp_path, f"mine: {{{base}{tracker}}}\n")
        scenario, lines = warned_of(path)
        assert lines == [] and renamed(scenario, "train") == load_scenario("train")
        for missing in ("descent: blind, ", "gate: auto, ", ", lift_height: 0.15", ", outline: ellipse"):
            path = write(tmp_path, f"mine: {{{base}{tracker.replace(missing, '')}}}\n")
            assert warned_of(path)[1] == [f"{path}: mine {CHANGED}"]


def test_overrides_count_for_the_warning(tmp_path):
    path = write(tmp_path, "mine: {base: train:guided}\nplain: {}\n")
    assert warned_of(f"{path}:mine", overrides=["grasp.descent=blind"])[1] == []
    overrides = ["vision=!Rendered {method: !MotionCentroid {}, outline: ellipse}", "estimator=!ArcLength {}"]
    assert warned_of(f"{path}:plain", overrides=overrides)[1] == [f"{path}: plain {CHANGED}"]
    overrides += ["grasp.descent=blind", "grasp.gate=auto", "grasp.lift_height=0.15"]
    assert warned_of(f"{path}:plain", overrides=overrides)[1] == []


@pytest.mark.parametrize("name", [name for name, _ in list_scenarios()])
def test_a_saved_scenario_does_not_warn(tmp_path, name):
    for overrides in ([], ["seed=4"]):
        scenario = load_scenario(name, overrides=overrides)
        save_scenario(scenario, tmp_path / "saved.yaml")
        assert warned_of(tmp_path / "saved.yaml") == (scenario, [])


def test_a_saved_estimator_without_a_tag_is_the_closed_path(tmp_path):
    """Files that earlier versions saved give the first kind of a role without its tag."""
    learned = load_scenario("train:learned", overrides=["estimator.systematic_std=0.003"])
    save_scenario(learned, tmp_path / "saved.yaml")
    saved = yaml.safe_load((tmp_path / "saved.yaml").read_text())["saved"]
    assert saved["estimator"]["systematic_std"] == 0.003  # safe_load rejects a tag
    assert warned_of(tmp_path / "saved.yaml") == (learned, [])
    path = write(tmp_path, "mine: {estimator: {systematic_std: 0.003}}\n")
    assert warned_of(path)[0].estimator == ClosedPath(systematic_std=0.003)


@pytest.mark.parametrize(
    "former, present",
    [
        ("{tracker: !Several {coast_time: 1.0}}", "{method: !SilhouetteTracker {coast_time: 1.0}}"),
        ("{tracker: !Single {}, detector: {stride: 2}}", "{method: !MotionCentroid {detector: {stride: 2}}}"),
        (
            "!Measured {tracker: !Several {coast_time: 1.0, min_pixels: 9}}",
            "!Measured {method: !SeveralObjects {coast_time: 1.0}}",
        ),
        ("{detector: {}, tracker: !Several {}}", "{method: !SilhouetteTracker {}}"),
    ],
)
def test_former_settings_of_vision_are_translated(tmp_path, former, present):
    def vision_of(text):
        scenario, lines = warned_of(write(tmp_path, f"mine: {{base: train:learned, vision: {text}}}\n"))
        return scenario.vision, lines

    found, lines = vision_of(former)
    assert (found, []) == vision_of(present) and "vision.tracker is now called vision.method" in lines[0]


def test_former_settings_of_vision_are_translated_in_overrides():
    with pytest.warns(DrakeTrackerWarning, match=r"^--set vision.detector.stride=2: vision.detector is now called"):
        scenario = load_scenario("train", overrides=["vision.detector.stride=2"])
    assert scenario.vision.method.detector.stride == 2
    with pytest.warns(DrakeTrackerWarning, match="here !SilhouetteTracker"):
        scenario = load_scenario("train", overrides=["vision.tracker=!Several {}", "vision.tracker.coast_time=1"])
    assert scenario.vision.method == SilhouetteTracker(coast_time=1.0)
    assert load_scenario("train:guided", overrides=["vision=!Measured {}"]).vision.method == SeveralObjects()
    with pytest.raises(DrakeTrackerError, match="there is no setting vision.detector"):
        load_scenario("train", overrides=["vision=!Measured {detector: {}}"])


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("grasp.lift_hight=0.2", "did you mean grasp.lift_height?"),
        ("servo.tracking_idx=0.1", "did you mean servo.tracking_index?"),
        ("train.speed=0.2", "did you mean track.speed?"),  # nothing in its own section is similar
    ],
)
def test_a_misspelt_setting_suggests_one_of_its_own_section(override, said):
    with pytest.raises(DrakeTrackerError, match=re.escape(said)):
        load_scenario("train", overrides=[override])


@pytest.mark.parametrize(
    ("task", "former", "other"),
    [
        ("train", "grasp.jaw_speed=0.4", "grasp.jaw_speed=0.5"),
        ("ball", "board.placement_range=0.01", "board.placement_range=0.02"),
        ("conveyor", "tray.first_cell=[0.345, 0.19]", "tray.first_cell=[0.3, 0.19]"),
        ("conveyor", "eligibility={max_std: 0.006}", "eligibility.max_std=0.1"),
    ],
)
def test_a_former_setting_is_accepted_at_its_value_only(task, former, other):
    assert load_scenario(task, overrides=[former]) == load_scenario(task)
    with pytest.raises(DrakeTrackerError, match="is no longer a setting; it is fixed at"):
        load_scenario(task, overrides=[other])
