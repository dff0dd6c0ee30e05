"""Tests of custom parts: `!Custom` finds them, passes their parameters, and reports what is wrong with them."""

import functools
import pickle
import re
import shutil
import sys
import typing
from pathlib import Path

import numpy as np
import own_estimator
import pytest
from pydrake.lcm import DrakeLcm

from drake_tracker import cli, load_scenario, make_diagram, simulate
from drake_tracker.arm.description import PUMA560, ArmDescription
from drake_tracker.campaign.plan import make_plan, run_trial
from drake_tracker.campaign.pool import pool
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.custom import check_role
from drake_tracker.diagrams.parts import check_custom_parts
from drake_tracker.estimation.estimator import Estimator
from drake_tracker.run.options import RunOptions
from drake_tracker.scenarios.base import Custom
from drake_tracker.tasks import save_scenario
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.two_processes import make_arm_side

SOURCE = Path(__file__).parents[1] / "own_estimator.py"
ARM = """
from dataclasses import replace
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT

from drake_tracker.arm.description import ArmDescription

def make_arm(inertia=3.7, flange="flange", joints=6) -> ArmDescription:
    values = (inertia, 4.2, 1.1, 0.25, 0.2, 0.2)[:joints]
    return replace(PUMA560, servo_inertia=values, flange=flange)

def with_cup(probe=True) -> ArmDescription:
    return PUMA560_CUP if probe else replace(PUMA560, fingers=())

def seven_with_jaws() -> "ArmDescription":
    hand = {name: getattr(PUMA560, name) for name in ("gripper_url", "finger_stiffness", "finger_damping", "fingers")}
    return replace(SEVEN_JOINT, **hand)

def one_finger() -> ArmDescription:
    return replace(PUMA560, fingers=("finger_left",))

def number() -> ArmDescription:
    return 3
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder for modules whose names no other test uses."""
    (tmp_path / "scenario").mkdir()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    monkeypatch.setattr(sys, "path", list(sys.path))
    return tmp_path / "scenario"


@pytest.fixture
def name(request):
    return f"own_{abs(hash(request.node.nodeid)) % 10**8}"


def write(folder, name, call="StraightOn", more=""):
    shutil.copy(SOURCE, folder / f"{name}.py")
    path = folder / "mine.yaml"
    own = f"vision: !Measured {{}}, estimator: !Custom {{call: {name}.{call}{more}}}"
    path.write_text(f"mine: {{base: train:guided, {own}}}\n")
    return str(path)


def error_of(*args, **kwargs):
    with pytest.raises(DrakeTrackerError) as caught:
        check_custom_parts(load_scenario(*args, **kwargs, allow_code=True))
    (line,) = str(caught.value).splitlines()
    return line


def test_a_module_next_to_the_scenario_is_found_also_from_a_saved_scenario(folder, name):
    scenario = load_scenario(write(folder, name, more=", parameters: {std: 0.02}"))
    assert scenario.estimator == Custom(f"{name}.StraightOn", {"std": 0.02}, str(folder))
    save_scenario(scenario, "scenario.yaml")
    assert load_scenario("scenario.yaml:scenario").estimator == scenario.estimator
    moved = Path(shutil.move(folder, folder.with_name("moved")))
    shutil.copy(moved / f"{name}.py", "..")
    shutil.copy("scenario.yaml", "../again.yaml")
    assert name not in sys.modules
    assert load_scenario("../again.yaml:scenario").estimator.folder == str(Path("..").resolve())


def test_parameters_keep_their_types_also_for_drake(folder, name):
    from pydrake.common.yaml import yaml_load

    parameters = {"number": 1.0, "count": 3, "switch": True, "word": "off", "digits": "12", "none": ""}
    scenario = TrainScenario(estimator=Custom("a.b", parameters))
    save_scenario(scenario, folder / "resolved.yaml")
    read = yaml_load(filename=str(folder / "resolved.yaml"), private=True)["resolved"]["estimator"]["parameters"]
    assert read == parameters == load_scenario(str(folder / "resolved.yaml")).estimator.parameters
    assert {key: type(value) for key, value in read.items()} == {key: type(value) for key, value in parameters.items()}


def test_an_override_looks_in_the_current_folder_and_changes_one_parameter(folder, name):
    path = write(folder, name)
    shutil.copy(SOURCE, Path.cwd() / f"{name}b.py")
    overrides = [f"estimator=!Custom {{call: {name}b.StraightOn}}", "estimator.parameters.std=0.03"]
    estimator = load_scenario(path, overrides=overrides).estimator
    assert (estimator.folder, estimator.parameters) == (str(Path.cwd()), {"std": 0.03})


def test_loading_and_saving_a_scenario_executes_no_custom_code(folder, name, tmp_path):
    ran = tmp_path / "ran"
    path = write(folder, name)
    (folder / f"{name}.py").write_text(f"open({str(ran)!r}, 'w').close()\n")
    scenario = load_scenario(path, overrides=[f"arm=!Custom {{call: {name}.arm}}"], allow_code=True)
    save_scenario(scenario, tmp_path / "copy.yaml")
    load_scenario(str(tmp_path / "copy.yaml"), allow_code=True)
    assert not ran.exists() and name not in sys.modules
    with pytest.raises(DrakeTrackerError, match="has no class or function"):
        make_diagram(scenario)
    assert ran.exists()


def test_a_custom_estimator_runs_in_the_loop(folder, name):
    summary = simulate(
        load_scenario(write(folder, name), duration=1.0, allow_code=True), options=RunOptions(stop_when_over=False)
    )
    assert summary["prediction_rms_m"] > 0.0


def test_an_error_during_the_run_is_reported_and_the_run_up_to_it_is_kept(folder, name, tmp_path, capfd):
    path = write(folder, name, "Broken")
    with (folder / f"{name}.py").open("a") as file:
        file.write("\n\nclass Broken(StraightOn):\n    def predict(self, state, times):\n")
        file.write("        return super().predict(state, times) * (np.nan if state.stamp > 2.5 else 1.0)\n")
    assert (
        cli.main(["run", path, "--allow-code", "--out", str(tmp_path / "out"), "--no-record", "--duration", "5"]) == 2
    )
    said, line = [line for line in capfd.readouterr().err.splitlines() if line.startswith("drake-tracker: ")]
    assert said.endswith(f"{path} line 1: estimator runs {name}.Broken in {folder / name}.py")
    place = rf"\({name}.py line \d+\), at 2\.7\d\d s of the run$"
    assert re.search(rf"Broken\.predict returned a number that is not finite {place}", line), line
    assert {"log.npz", "summary.json", "tracking.png"} <= {path.name for path in (tmp_path / "out").iterdir()}


def test_workers_find_the_module_in_any_current_folder(folder, name, monkeypatch):
    plan = make_plan(write(folder, name), 1, overrides=["duration=0.6"], allow_code=True)
    monkeypatch.chdir("/")
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry != str(folder)])
    ((_, row),) = pool(1)(run_trial, plan.jobs())
    assert not row["success"] and "Error" not in row["failure_reason"], row["failure_reason"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("StraightOn, parameters: {stdd: 1}", "StraightOn: got an unexpected keyword argument 'stdd'; it takes std"),
        ("StraightOn, parameters: {std: 0}", "{name}.StraightOn raised ValueError: std is 0 ({name}.py line"),
        ("StraightAhead", "{name} has no class or function StraightAhead; it has Newest, StraightOn, "),
        ("WithoutStd", "{name}.WithoutStd has no method predict_std; an estimator has initial_state, update, "),
        ("StraightOn, parameters: [1]", "estimator.parameters must be names, each with a number, true or false, or"),
        ("StraightOn, parameters: {std: [1]}", "estimator.parameters.std must be a number, true or false, or text"),
    ],
)  # fmt: skip
def test_a_mistake_gives_one_line_that_says_where(folder, name, call, message):
    path = write(folder, name, call)
    line = error_of(path)
    assert line.startswith(f"{path} line 1: estimator") and message.format(name=name) in line, line


def test_a_module_that_does_not_exist_or_does_not_load(folder, name):
    def trying(call):
        return error_of("train:learned", overrides=[f"estimator=!Custom {{call: {call}}}"])

    assert f"there is no module {name}; looked next to the scenario, in {Path.cwd()}" in trying(f"{name}.X")
    assert "estimator.call must be module.name" in trying(name)
    assert "estimator.call must be module.name" in trying('""')
    for k, (text, message) in enumerate([
        ("x = (", "line 1: '(' was never closed"),
        ("\nimport no_such_package_at_all", "ModuleNotFoundError: No module named 'no_such_package_at_all'"),
        ("import sys\nsys.exit(0)", "raised SystemExit: 0 ({module}.py line 2)"),
        ("\n\n1 / 0", "raised ZeroDivisionError: division by zero ({module}.py line 3)"),
    ]):  # fmt: skip
        module = f"{name}_{k}"
        Path(f"{module}.py").write_text(text)
        assert message.format(module=module) in trying(f"{module}.X")
    Path("statistics.py").write_text("class Mine: pass")
    assert "another module is also named statistics" in trying("statistics.Mine")


def test_a_custom_arm(folder, name):
    Path(f"{name}.py").write_text(ARM)
    measured = "vision=!Measured {}"

    def arm(call):
        return [measured, f"arm=!Custom {{call: {name}.{call}}}"]

    diagram = make_diagram(load_scenario("train:learned", overrides=arm("make_arm, parameters: {inertia: 3.5}")))
    np.testing.assert_equal(diagram.world.laboratory.plant.num_actuated_dofs(diagram.world.laboratory.arm), 6)
    for call, message in {
        "make_arm, parameters: {flange: flansch}": "puma560.sdf has no frame flansch; its frames are base, link1",
        "make_arm, parameters: {joints: 2}": "servo_inertia has 2 values for 6 joints with actuators",
        "with_cup": "for the train the hand must have fingers",
        "one_finger": "fingers is ('finger_left',); a gripper has two joints, a cup none",
        "number": f"{name}.number returned a int; it must return an ArmDescription",
    }.items():
        assert message in error_of("train:learned", overrides=arm(call))
    assert "a hand without fingers: package://drake_tracker_models/gripper/gripper.sdf has no frame probe" in error_of(
        "ball", overrides=arm("with_cup, parameters: {probe: false}")[1:]
    )
    assert load_scenario("ball", overrides=arm("with_cup")[1:]).arm.folder == str(Path.cwd())


def test_an_arm_with_more_joints_is_sent_in_full_between_processes(folder, name):
    Path(f"{name}.py").write_text(ARM)
    overrides = ["vision=!Measured {}", f"arm=!Custom {{call: {name}.seven_with_jaws}}"]
    arm_side = make_arm_side(load_scenario("train:learned", overrides=overrides), DrakeLcm("memq://"))
    assert arm_side.GetOutputPort("arm_state").size() == 14


def test_a_scenario_with_a_custom_part_can_be_pickled(folder, name):
    scenario = load_scenario(write(folder, name))
    again = pickle.loads(pickle.dumps(scenario))
    assert again == scenario and again.where("estimator") == scenario.where("estimator")


if typing.TYPE_CHECKING:
    from drake_tracker.arm.description import ArmDescription as Arm


def never() -> typing.Any:
    raise AssertionError("it was called")


def makes_estimator() -> Estimator:
    return never()


def makes_estimator_of_a_state() -> Estimator[own_estimator.Newest]:
    return never()


def makes_its_own_class() -> own_estimator.StraightOn:
    return never()


def makes_arm() -> ArmDescription:
    return never()


def makes_arm_by_name() -> "ArmDescription":
    return never()


def makes_arm_of_a_module() -> "own_estimator.ArmDescription":
    return never()


def makes_arm_under_another_name() -> "Arm":
    return never()


def makes_a_number() -> int:
    return never()


def states_nothing():
    return never()


class IsAnArm(ArmDescription):
    def __init__(self):
        never()


@pytest.mark.parametrize(
    ("make", "role"),
    [
        (own_estimator.StraightOn, Estimator),
        (makes_estimator, Estimator),
        (makes_estimator_of_a_state, Estimator),
        (makes_its_own_class, Estimator),
        (makes_arm, ArmDescription),
        (makes_arm_by_name, ArmDescription),
        (makes_arm_of_a_module, ArmDescription),
        (IsAnArm, ArmDescription),
        (ArmDescription, ArmDescription),
    ],
)
def test_what_makes_a_part_of_the_role_is_accepted(make, role):
    check_role(make, role, "mine.make")


@pytest.mark.parametrize(
    ("make", "role", "message"),
    [
        (
            own_estimator.WithoutStd,
            Estimator,
            "has no method predict_std; an estimator has initial_state, update, ready",
        ),
        (dict, Estimator, "has no method initial_state, ready, predict, predict_std"),
        (makes_arm, Estimator, "is annotated with -> ArmDescription; it must return an estimator, Estimator"),
        (makes_a_number, ArmDescription, "is annotated with -> int; it must return an arm, ArmDescription"),
        (makes_arm_under_another_name, ArmDescription, "is annotated with -> Arm; it must return an arm"),
        (makes_estimator, ArmDescription, "is annotated with -> Estimator"),
        (states_nothing, ArmDescription, "annotate it: def states_nothing(...) -> ArmDescription"),
        (lambda: never(), Estimator, "does not state what it returns"),
        (own_estimator.StraightOn, ArmDescription, "is a class that is no ArmDescription"),
        (print, Estimator, "is a builtin_function_or_method; an estimator is made by a class that is one, or by a"),
        (functools.partial(makes_arm), ArmDescription, "is a partial; an arm is made by"),
        (PUMA560, ArmDescription, "is a ArmDescription"),
    ],
)
def test_anything_else_is_refused_in_one_line(make, role, message):
    with pytest.raises(DrakeTrackerError) as caught:
        check_role(make, role, "mine.make")
    assert str(caught.value).startswith("mine.make ") and message in str(caught.value), caught.value
