"""Every kind of fault: its settings, its registration, its wiring and its documentation."""

import dataclasses
from pathlib import Path

import pytest
from faulty_runs import KINDS, all_at_once, make
from pydrake.systems.analysis import Simulator

from drake_tracker import DrakeTrackerError, load_scenario, make_diagram
from drake_tracker.core.setting import key_of, replace_settings, settings_of
from drake_tracker.faults import fault as places
from drake_tracker.faults.config import CameraDark, LinkLoss, TrainStopped
from drake_tracker.faults.fault import Fault
from drake_tracker.scenarios.reader import describe_settings
from drake_tracker.tasks import save_scenario

METHODS = {
    places.ImageFault: "image",
    places.PointFault: "centroid",
    places.CalibrationFault: "calibrated",
    places.LinkFault: "link",
    places.HostFault: "estimator",
    places.SpeedFault: "target_speed",
    places.TrainFault: "wrench",
    places.SceneFault: "slide",
    places.JointFault: "torques",
    places.GripperFault: "set_point",
    places.EncoderFault: "travelled",
}
ENCODER = {"train:learned": [], "conveyor": ["belt.encoder=true"]}
GUIDE = Path(__file__).parents[2] / "docs" / "how_to" / "inject_faults.md"


def test_every_place_is_tested():
    found = {kind for kind in vars(places).values() if isinstance(kind, type) and issubclass(kind, Fault)}
    assert found - {Fault} == set(METHODS)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
class TestEveryKind:
    def test_has_a_place_and_a_task(self, kind):
        assert isinstance(make(kind()), tuple(METHODS))
        assert {"train", "conveyor"} & set(kind.tasks)

    def test_is_written_and_read_again(self, kind, tmp_path):
        changed = {} if kind.__name__ == "CalibrationWrong" else {"at": 4.0, "for": 2.5}
        scenario = with_fault(kind)
        scenario = scenario.with_settings({"faults": [replace_settings(scenario.faults[0], changed)]})
        path = tmp_path / "mine.yaml"
        save_scenario(scenario, path)
        assert load_scenario(str(path)).faults == scenario.faults == (kind(**renamed(changed)),)

    def test_is_described(self, kind):
        rows = describe_settings(with_fault(kind))
        own = {key for key, *_ in rows if key.startswith("faults[0].")}
        assert own == {f"faults[0].{key_of(field)}" for field in settings_of(kind)}
        assert kind.__doc__.strip().endswith(".")

    def test_is_in_the_guide(self, kind):
        assert f"`!{kind.__name__}`" in GUIDE.read_text(encoding="utf-8")


def with_fault(kind):
    """Returns a scenario with one fault, of a task in which it can happen."""
    name = "train:learned" if "train" in kind.tasks else "conveyor"
    return load_scenario(name, overrides=[f"faults=[!{kind.__name__} {{}}]", *ENCODER[name]])


def renamed(changes):
    return {"duration" if key == "for" else key: value for key, value in changes.items()}


def test_every_fault_acts_where_it_says(monkeypatch):
    """All faults at once: each is asked at each of its places, with cameras or with measured vision."""
    acted = set()

    def spy(cls, place, method):
        original = getattr(cls, method)

        def recording(self, *args):
            acted.add((type(self.settings), place))
            return original(self, *args)

        return recording

    expected = set()
    for kind in KINDS:
        cls = type(make(kind()))
        for place in METHODS:
            if issubclass(cls, place):
                expected.add((kind, place))
    for cls in {type(make(kind())) for kind in KINDS}:
        for place, method in METHODS.items():
            if issubclass(cls, place):
                monkeypatch.setattr(cls, method, spy(cls, place, method))
    for vision in ([], ["vision=!Measured {}"]):
        hand_eye = make_diagram(
            load_scenario("train:learned", overrides=[all_at_once(), "cameras.render_processes=0", *vision])
        )
        simulator = Simulator(hand_eye)
        simulator.AdvanceTo(0.15)
        if not vision:
            hand_eye.GetOutputPort("camera_left").Eval(hand_eye.GetMyContextFromRoot(simulator.get_context()))
    others = [kind for kind in KINDS if "train" not in kind.tasks]
    faults = ", ".join(f"!{kind.__name__} {{at: {0.05 * k}}}" for k, kind in enumerate(others))
    overrides = [f"faults=[{faults}]", "belt.encoder=true", "cameras.render_processes=0"]
    Simulator(make_diagram(load_scenario("conveyor", duration=9.0, seed=5, overrides=overrides))).AdvanceTo(0.15)
    assert acted == expected


def test_without_faults_nothing_is_inserted():
    for vision in ([], ["vision=!Measured {}"]):
        hand_eye = make_diagram(load_scenario("train:learned", overrides=vision))
        names = [system.get_name() for part in (hand_eye.world, hand_eye.vision) for system in part.GetSystems()]
        assert not [name for name in names if "fault" in name or name == "train_forces"]
        assert type(hand_eye.link._link).__name__ == "LossyLink"
        assert type(hand_eye.host._estimator).__name__ == "ClosedPathEstimator"


def test_a_fault_lasts_from_its_beginning_to_before_its_end():
    fault = make(CameraDark(at=4.0, duration=2.0))
    assert [fault.active(time) for time in (3.99, 4.0, 5.99, 6.0)] == [False, True, True, False]
    assert fault.active(240 * (1 / 60)) and not fault.active(360 * (1 / 60))
    assert make(CameraDark(at=4.0)).active(1e6)


def test_the_ball_has_the_faults_of_images_link_and_host():
    scenario = load_scenario("ball", overrides=[all_at_once("ball")])
    assert {type(item).__name__ for item in scenario.faults} == {
        *(
            "CameraDark",
            "FrozenImage",
            "Flicker",
            "ImageNoise",
            "CameraKnocked",
            "CameraShake",
            "CameraPan",
            "LinkLoss",
            "LinkBursts",
            "LinkJitter",
        ),
        *("LinkDelay", "HostStopped"),
    }


@pytest.mark.parametrize(
    "task, text, message",
    [
        ("train", "[!CameraDrak {}]", "not !CameraDrak; did you mean !CameraDark?"),
        ("train", "[!LinkLoss {at: -1}]", "faults[0].at must be a number from 0 to 36000 s, not -1"),
        ("train", "[!LinkLoss {}, !LinkLoss {fro: 2}]", "no setting faults[1].fro; did you mean faults[1].for?"),
        ("train", "[!LinkLoss {for: 0}]", "faults[0].for must be a number from 0.001 to 36000 s, not 0"),
        ("train", "[!LinkLoss {delay: 2}]", "faults[0].delay in !LinkLoss; it belongs to faults[0]: !LinkDelay"),
        ("train", "[{at: 3}]", "faults[0] must begin with one of !CameraDark"),
        ("train", "!LinkLoss {}", "faults must be a list of !CameraDark"),
        ("train", "3", "faults must be a list of !CameraDark"),
        ("ball", "[!TrainStopped {}]", "not !TrainStopped"),
        ("ball", "[!CameraDark {camera: left}]", "faults[0].camera must be both: the ball has one camera"),
    ],
)
def test_a_wrong_fault_gives_one_line(task, text, message):
    with pytest.raises(DrakeTrackerError) as caught:
        load_scenario(task, overrides=[f"faults={text}"])
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"--set faults={text}: ") and message in line


def test_all_wrong_faults_of_a_file_are_reported_with_their_lines(tmp_path):
    path = tmp_path / "mine.yaml"
    head = "mine:\n  base: train:learned\n  faults:\n"
    path.write_text(f"{head}  - !LinkLoss {{drop: 2}}\n  - !TrainStopped\n  - !HostStoped {{}}\n")
    with pytest.raises(DrakeTrackerError) as caught:
        load_scenario(str(path))
    lines = str(caught.value).splitlines()
    assert [line.partition(": ")[0] for line in lines] == [f"{path} line 4", f"{path} line 6"]
    path.write_text(f"{head}  - !LinkLoss {{drop: 0.5, for: 1}}\n  - !TrainStopped\n")
    scenario = load_scenario(str(path))
    assert scenario.faults == (LinkLoss(drop=0.5, duration=1.0), TrainStopped())
    assert scenario.where("faults[0].drop") == f"{path} line 4: faults[0].drop"


def test_a_campaign_can_vary_the_faults():
    from drake_tracker.campaign.grid import make_cells, parse_vary

    vary = parse_vary(["faults=[],[!LinkLoss {at: 2, for: 1}],[!CameraDark {camera: left}, !HostStopped {}]"])
    cells = make_cells("train:learned", [], vary)
    assert [len(cell.scenario.faults) for cell in cells] == [0, 1, 2]


def test_a_setting_has_one_name_in_a_scenario():
    field = next(field for field in dataclasses.fields(CameraDark) if field.name == "duration")
    assert key_of(field) == "for"
    assert replace_settings(CameraDark(), {"for": 2.0}).duration == 2.0
    with pytest.raises(AttributeError, match="no setting 'duration'"):
        replace_settings(CameraDark(), {"duration": 2.0})


def test_a_joint_that_the_arm_does_not_have_is_refused():
    with pytest.raises(DrakeTrackerError, match=r"faults\[0\]\.joint is 8; the joints of this arm are 1 to 6"):
        make_diagram(
            load_scenario("train:learned", overrides=["faults=[!StickingJoint {joint: 8}]", "vision=!Measured {}"])
        )
