"""Tests of the consent to code that a file names: nothing of it is imported or called without, in any command."""

import os
import pickle
import shutil
import sys
from pathlib import Path

import pytest

from drake_tracker import cli, load_scenario, make_diagram
from drake_tracker.campaign.plan import make_plan
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.parts import check_custom_parts
from drake_tracker.scenarios.base import Custom
from drake_tracker.scenarios.consent import TRUSTED_FOLDERS, code_place
from drake_tracker.tasks import save_scenario
from drake_tracker.tasks.train.scenario import TrainScenario

SOURCE = Path(__file__).parents[1] / "own_estimator.py"


@pytest.fixture
def theirs(tmp_path, monkeypatch, request):
    """A scenario file of somebody else, whose estimator leaves a file when it is imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delenv(TRUSTED_FOLDERS, raising=False)
    folder = tmp_path / "theirs"
    folder.mkdir()
    name = f"theirs_{abs(hash(request.node.nodeid)) % 10**8}"
    text = SOURCE.read_text() + f"\n\nopen({str(tmp_path / 'ran')!r}, 'w').close()\n"
    (folder / f"{name}.py").write_text(text)
    path = folder / "theirs.yaml"
    path.write_text(
        f"theirs:\n  base: train:guided\n  vision: !Measured {{}}\n  duration: 0.4\n"
        f"  estimator: !Custom\n    call: {name}.StraightOn\n    parameters: {{std: 0.02}}\n"
    )
    return path


def name_of(path):
    return load_scenario(str(path)).estimator.call.partition(".")[0]


def ran():
    return Path("ran").exists()


def refusal(scenario):
    with pytest.raises(DrakeTrackerError) as caught:
        check_custom_parts(scenario)
    (line,) = str(caught.value).splitlines()
    assert not ran()
    return line


def errors(capfd):
    return [line for line in capfd.readouterr().err.splitlines() if line.startswith("drake-tracker: ")]


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "{path}", "--no-record", "--out", "out"],
        ["run", "{path}", "--no-record", "--out", "out", "--live"],
        ["run", "{path}", "--set", "estimator.parameters.std=0.03", "--out", "out"],
        ["campaign", "{path}", "--trials", "1", "--workers", "1", "--out", "out"],
        ["campaign", "{path}", "--trials", "1", "--vary", "estimator.parameters.std=0.02,0.03", "--out", "out"],
        ["arm", "{path}", "--set", "arm=!Custom {{call: no_such_module_at_all.X}}", "--out", "out"],
        ["host", "{path}"],
        ["measure", "{path}", "--set", "vision=!Rendered {{}}", "-o", "error.yaml", "--seeds", "1", "--laps", "1"],
    ],
    ids=lambda arguments: f"{arguments[0]}{len(arguments)}",
)
def test_no_command_runs_code_that_a_file_names_without_consent(theirs, capfd, arguments):
    before = set(sys.modules)
    assert cli.main([argument.format(path=theirs) for argument in arguments]) == 2
    (line,) = errors(capfd)
    if arguments[0] != "arm":  # which makes no estimator; the arm that it lacks was named on the command line
        name = name_of(theirs)
        assert line.startswith(f"drake-tracker: {theirs} line 6: the file names code to run, {name}.StraightOn in ")
        assert str(theirs.with_name(f"{name}.py")) in line and "--allow-code" in line and TRUSTED_FOLDERS in line
    assert not ran() and not Path("out").exists()
    assert not [name for name in set(sys.modules) - before if name.startswith("theirs_")]


def test_with_consent_the_command_says_what_runs(theirs, capfd):
    assert cli.main(["run", str(theirs), "--no-record", "--out", "out", "--allow-code"]) == 1
    (line,) = errors(capfd)
    name = name_of(theirs)
    place = theirs.with_name(f"{name}.py")
    assert line == f"drake-tracker: {theirs} line 6: estimator runs {name}.StraightOn in {place}"
    assert ran()
    Path("ran").unlink()
    assert cli.main(["replay", "out", "--out", "again"]) == 2
    (line,) = [line for line in errors(capfd) if "code" in line]
    assert line.startswith("drake-tracker: out/scenario.yaml line ") and not ran()
    assert cli.main(["replay", "out", "--out", "again", "--allow-code"]) == 0
    assert cli.main(["replay", "out", "--out", "other", "--set", "estimator=!ClosedPath {}"]) == 0


def test_a_campaign_says_once_what_runs_and_its_workers_have_the_consent(theirs, capfd, monkeypatch):
    def carry_out(plan, *_):
        raise DrakeTrackerError("nothing is carried out")

    monkeypatch.setattr("drake_tracker.campaign.run.carry_out", carry_out)
    arguments = ["campaign", str(theirs), "--trials", "2", "--vary", "estimator.parameters.std=0.02,0.03"]
    assert cli.main([*arguments, "--allow-code"]) == 2
    said, _ = errors(capfd)
    assert said.startswith(f"drake-tracker: {theirs} line 6: estimator runs {name_of(theirs)}.StraightOn in ") and ran()
    trial = next(make_plan(str(theirs), 1, allow_code=True).jobs())
    assert pickle.loads(pickle.dumps(trial)).scenario.estimator.allowed


def test_a_part_named_on_the_command_line_or_in_python_needs_no_consent(theirs):
    name = name_of(theirs)
    given = load_scenario("train:learned", overrides=[f"estimator=!Custom {{call: {name}.StraightOn}}"])
    assert given.estimator.named_at == "" and given.estimator.allowed
    here = f"estimator=!Custom {{call: {name}.StraightOn, folder: {theirs.parent}}}"
    check_custom_parts(load_scenario(str(theirs), overrides=[here]))
    check_custom_parts(TrainScenario(estimator=Custom(f"{name}.StraightOn", folder=str(theirs.parent))))
    assert ran()


@pytest.mark.parametrize("key", ["parameters.std=0.03", "folder=theirs", "call={name}.StraightOn"])
def test_an_override_of_a_part_of_it_gives_no_consent_to_the_rest(theirs, key):
    scenario = TrainScenario(estimator=Custom(f"{name_of(theirs)}.StraightOn", folder=str(theirs.parent)))
    save_scenario(scenario, "saved.yaml")
    overrides = [f"estimator.{key.format(name=name_of(theirs))}"]
    assert "saved.yaml line " in refusal(load_scenario("saved.yaml", overrides=overrides))


def test_a_file_cannot_pretend_to_be_an_override(theirs):
    """The origin of a value is text for messages, and a file can be named like an option."""
    pretends = Path("--set estimator.call=x.yaml")
    shutil.copy(theirs, pretends)
    shutil.copy(theirs.with_name(f"{name_of(theirs)}.py"), ".")
    assert refusal(load_scenario(f"{pretends}:theirs")).startswith("--set estimator.call=x.yaml line 6:")


def test_the_base_of_a_scenario_names_code_too(theirs):
    with theirs.open("a") as file:
        file.write("other: {base: theirs, seed: 3, estimator: {parameters: {std: 0.01}}}\n")
    assert refusal(load_scenario(f"{theirs}:other")).startswith(f"{theirs} line 6:")
    check_custom_parts(load_scenario(f"{theirs}:other", allow_code=True))


def test_a_trusted_folder_is_consent(theirs, monkeypatch, tmp_path):
    monkeypatch.setenv(TRUSTED_FOLDERS, os.pathsep.join([str(tmp_path / "elsewhere"), str(theirs.parent)]))
    with pytest.raises(DrakeTrackerError, match="line 6: the file names code"):
        check_custom_parts(load_scenario(str(theirs), allow_code=False))
    link = tmp_path / "link.yaml"
    link.symlink_to(theirs)
    assert load_scenario(f"{link}:theirs").estimator.allowed
    check_custom_parts(load_scenario(str(theirs)))
    assert ran()
    Path("ran").unlink()
    outside = shutil.copy(theirs, tmp_path / "outside.yaml")
    theirs.unlink()
    theirs.symlink_to(outside)  # a link in a trusted folder to a file outside of it
    refusal(load_scenario(str(theirs)))
    monkeypatch.setenv(TRUSTED_FOLDERS, "theirs")
    with pytest.raises(DrakeTrackerError, match=f"{TRUSTED_FOLDERS}: theirs must be an absolute path"):
        load_scenario(str(theirs))


def test_listing_and_saving_import_nothing(theirs):
    assert cli.main(["list", str(theirs)]) == 0
    save_scenario(load_scenario(str(theirs), allow_code=True), "copy.yaml")
    assert load_scenario("copy.yaml:copy").seed == 0
    assert not ran() and str(theirs.parent) not in sys.path


@pytest.mark.parametrize(
    ("call", "place"),
    [
        ("os.system", "of the installed package os"),
        ("builtins.exec", "of the installed package builtins"),
        ("no_such_module_at_all.X", "of a module that was not found"),
        ("xml.etree.ElementTree.parse", "of the installed package xml ("),
        ("../up.X", "of a module that was not found"),
        (f"{'a' * 5000}.X", "of a module that was not found"),
    ],
)
def test_the_place_of_code_is_found_without_importing_it(tmp_path, monkeypatch, call, place):
    monkeypatch.chdir(tmp_path)
    for loaded in ("xml", "xml.etree", "xml.etree.ElementTree"):
        monkeypatch.delitem(sys.modules, loaded, raising=False)
    assert code_place(Custom(call)).startswith(place)
    assert "xml" not in sys.modules
    path = tmp_path / "mine.yaml"
    path.write_text(f"mine: {{base: train:guided, estimator: !Custom {{call: {call}}}}}\n")
    load_scenario(str(path))


@pytest.mark.parametrize("call", ["os.system", "subprocess.run", "builtins.exec", "subprocess.Popen", "pathlib.Path"])
def test_what_is_no_estimator_is_never_called(tmp_path, monkeypatch, call):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.yaml"
    parameters = "parameters: {command: touch ran}"
    own = f"vision: !Measured {{}}, estimator: !Custom {{call: {call}, {parameters}}}"
    path.write_text(f"mine: {{base: train:guided, {own}}}\n")
    with pytest.raises(DrakeTrackerError) as caught:
        make_diagram(load_scenario(str(path), allow_code=True))
    (line,) = str(caught.value).splitlines()
    assert f"estimator: {call}" in line and not ran()
