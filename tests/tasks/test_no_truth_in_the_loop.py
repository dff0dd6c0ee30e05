"""Tests that ground truth does not reach the controller, neither through connections nor through Python references."""

import functools
import types

import pytest
from faulty_runs import all_at_once
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from wires import Wires, controller_subsystems, references, truths

from drake_tracker import load_scenario, make_diagram
from drake_tracker.live.operator import OperatorPanel
from drake_tracker.live.operator_system import OperatorSystem
from drake_tracker.measured.measured_error_system import MeasuredErrorSystem
from drake_tracker.measured.measured_parts_system import MeasuredPartsSystem
from drake_tracker.measured.measured_vision_diagram import MeasuredVisionDiagram
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.train import diagram as train_diagram
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.world.config import TrackConfig as TrackSettings
from drake_tracker.world.train import world_diagram as world_module

MEASURED = "vision=!Measured {}"
MEASURED_SEVERAL = "vision=!Measured {method: !SeveralObjects {}}"
OBJECTS = "objects=[!Train {}, !Ball {}, !Hand {}]"
BEHIND_THE_SENSORS = {
    *("camera_left_noise", "camera_right_noise", "camera_left_faults", "camera_right_faults", "jaw_sensor"),
    *("camera_wrist_noise", "camera_wrist_faults"),
}
"""Systems of the world between a sensor and the port that the controller reads."""


def measured(hand_eye, stand_in):
    """Returns the output ports of leaf Systems that the controller may read, {port: name of the sensor}.

    With ``vision: !Measured`` (``stand_in``), and only then, one System that reads ground truth replaces the cameras,
    and its output counts as a sensor; with several objects, one for each of them.
    """
    world = hand_eye.world
    laboratory = world.laboratory
    plant = laboratory.plant
    ports = {name: camera.sensor_port for name, camera in world.cameras.items()}
    ports["joints of the arm"] = plant.get_state_output_port(laboratory.arm)
    ports["drives of the arm"] = plant.get_net_actuation_output_port(laboratory.arm)
    ports["joints of the gripper"] = plant.get_state_output_port(laboratory.gripper)
    ports["drive of the gripper"] = plant.get_net_actuation_output_port(laboratory.gripper)
    if stand_in:
        assert type(hand_eye.vision) is MeasuredVisionDiagram and not world.cameras
        for system in stand_ins(hand_eye.vision):
            ports[f"stand-in for cameras: {system.get_name()}"] = system.GetOutputPort("point")
    return {(port.get_system(), int(port.get_index())): name for name, port in ports.items()}


def stand_ins(vision):
    return [system for system in vision.GetSystems() if type(system) is MeasuredErrorSystem]


def leaks(hand_eye, stand_in=False):
    """Returns the paths from ground truth to the controller, and the sensors that reach it."""
    allowed = measured(hand_eye, stand_in)
    wires = Wires(hand_eye)
    wires.leave_open(hand_eye.arm, "operator")
    if hand_eye.vision.HasInputPort("selected"):
        wires.leave_open(hand_eye.vision, "selected")
    subsystems = controller_subsystems(hand_eye)
    if stand_in:  # the vision without the Systems that replace the cameras
        del subsystems["vision"]
        others = [system for system in hand_eye.vision.GetSystems() if system not in stand_ins(hand_eye.vision)]
        subsystems |= {system.get_name(): system for system in others}
    upstream = wires.upstream(subsystems.values(), allowed)
    leaking = [
        path
        for (leaf, port), path in upstream.items()
        if (leaf, port) not in allowed
        and wires.inside(leaf, hand_eye.world)
        and leaf.get_name() not in BEHIND_THE_SENSORS
    ]
    return leaking, {allowed[found] for found in upstream if found in allowed}


@pytest.fixture(scope="module")
def conveyor():
    """A diagram of the conveyor, whose belt has an encoder."""
    return make_diagram(load_scenario("conveyor:measured", duration=9.0, seed=5, overrides=["belt.encoder=true"]))


@pytest.fixture(scope="module")
def conveyor_with_cameras():
    """The same with cameras."""
    return make_diagram(load_scenario("conveyor", duration=9.0, seed=5, overrides=["belt.encoder=true"]))


def leaks_of_the_conveyor(hand_eye, stand_in=True):
    """Returns the paths from ground truth to the controller, and the sensors that reach it."""
    laboratory, plant = hand_eye.world.laboratory, hand_eye.world.laboratory.plant
    drive = hand_eye.world.GetSubsystemByName("belt_drive")
    ports = {name: camera.sensor_port for name, camera in hand_eye.world.cameras.items()}
    ports |= {
        "joints of the arm": plant.get_state_output_port(laboratory.arm),
        "drives of the arm": plant.get_net_actuation_output_port(laboratory.arm),
        "joints of the gripper": plant.get_state_output_port(laboratory.gripper),
        "drive of the gripper": plant.get_net_actuation_output_port(laboratory.gripper),
        "encoder": drive.GetOutputPort("encoder"),
    }
    if stand_in:
        parts = hand_eye.vision.GetSubsystemByName("measured_0")
        assert type(parts) is MeasuredPartsSystem and not hand_eye.world.cameras
        ports["stand-in for cameras"] = parts.GetOutputPort("parts")
    allowed = {(port.get_system(), int(port.get_index())): name for name, port in ports.items()}
    wires = Wires(hand_eye)
    wires.leave_open(hand_eye.arm, "operator")
    subsystems = controller_subsystems(hand_eye)
    if stand_in:
        del subsystems["vision"]
        subsystems["lag"] = hand_eye.vision.GetSubsystemByName("lag_parts")
    upstream = wires.upstream(subsystems.values(), allowed)
    leaking = [
        path
        for (leaf, port), path in upstream.items()
        if (leaf, port) not in allowed
        and wires.inside(leaf, hand_eye.world)
        and leaf.get_name() not in BEHIND_THE_SENSORS
    ]
    return leaking, {allowed[found] for found in upstream if found in allowed}, set(ports)


def test_the_controller_of_the_conveyor_reads_ground_truth_only_through_its_measured_vision(conveyor):
    leaking, reached, sensors = leaks_of_the_conveyor(conveyor)
    assert leaking == []
    assert reached == sensors
    system = conveyor.vision.GetSubsystemByName("measured_0")
    assert system.num_input_ports() == 1
    source, port = Wires(conveyor).source(system, 0)
    assert f"{source.get_name()}.{source.get_output_port(port).get_name()}" == "part_states.states"
    assert {part.get_name() for part in conveyor.vision.GetSystems()} == {"measured_0", "lag_parts"}
    for subsystem in controller_subsystems(conveyor).values():
        assert truths(subsystem, is_truth) == {}


def test_with_cameras_the_controller_of_the_conveyor_reads_no_ground_truth(conveyor_with_cameras):
    leaking, reached, sensors = leaks_of_the_conveyor(conveyor_with_cameras, stand_in=False)
    assert leaking == []
    assert reached == sensors and {"camera_left", "camera_right"} <= sensors
    for subsystem in controller_subsystems(conveyor_with_cameras).values():
        assert truths(subsystem, is_truth) == {}


def test_the_search_finds_the_measured_vision_of_the_conveyor(conveyor):
    leaking, _, _ = leaks_of_the_conveyor(conveyor, stand_in=False)
    assert any("measured_0" in path and "part_states.states" in path for path in leaking), leaking


@pytest.fixture(scope="module")
def hand_eye():
    return make_diagram(load_scenario("train:learned"))


def test_the_controller_reads_all_sensors_but_no_ground_truth(hand_eye):
    leaking, sensors = leaks(hand_eye)
    assert leaking == []
    assert sensors == set(measured(hand_eye, False).values())


@pytest.fixture(scope="module")
def blind():
    """A diagram with measured vision, without cameras."""
    return make_diagram(load_scenario("train:learned", overrides=[MEASURED]))


def test_measured_vision_is_the_only_system_that_reads_ground_truth(blind):
    leaking, sensors = leaks(blind, stand_in=True)
    assert leaking == []
    assert sensors == set(measured(blind, True).values())
    # It reads only the train's state, and the vision has no other System except the delay.
    system = blind.vision.GetSubsystemByName("measured_0")
    assert system.num_input_ports() == 1
    source, port = Wires(blind).source(system, 0)
    assert source is blind.world.laboratory.plant and source.get_output_port(port).get_name() == "train_state"
    assert {part.get_name() for part in blind.vision.GetSystems()} == {"measured_0", "lag_point"}


def test_measured_vision_is_a_leak_if_the_scenario_does_not_ask_for_it(blind):
    leaking, _ = leaks(blind)
    assert any("measured_0" in path and "plant.train_state" in path for path in leaking)


def test_markers_on_the_hand_give_the_controller_no_ground_truth():
    """The hand is found in images, near the place that the arm's own joints tell."""
    hand_eye = make_diagram(load_scenario("train:learned", overrides=["arm.markers=true"]))
    leaking, sensors = leaks(hand_eye)
    assert leaking == []
    assert sensors == set(measured(hand_eye, False).values())


def test_faults_give_the_controller_no_ground_truth():
    """Faults change what the controller reads, but what it reads still comes from the sensors alone."""
    for stand_in, overrides in ((False, []), (True, [MEASURED])):
        hand_eye = make_diagram(load_scenario("train:learned", overrides=[all_at_once(), *overrides]))
        leaking, sensors = leaks(hand_eye, stand_in)
        assert leaking == []
        assert sensors == set(measured(hand_eye, stand_in).values())
        for subsystem in controller_subsystems(hand_eye).values():
            assert truths(subsystem, is_truth) == {}


def test_further_objects_give_the_controller_no_ground_truth():
    for stand_in, overrides in ((False, []), (True, [MEASURED])):
        objects = "objects=[!Train {}, !Ball {}, !Hand {}]"
        hand_eye = make_diagram(load_scenario("train:learned", overrides=[objects, *overrides]))
        assert hand_eye.GetOutputPort("truth_object_states").size() == 3 * 13
        leaking, sensors = leaks(hand_eye, stand_in)
        assert leaking == []
        assert sensors == set(measured(hand_eye, stand_in).values())
        for subsystem in controller_subsystems(hand_eye).values():
            assert truths(subsystem, is_truth) == {}


@pytest.fixture(scope="module")
def several():
    """A diagram with measured vision of several objects."""
    return make_diagram(load_scenario("train:learned", overrides=[MEASURED_SEVERAL, OBJECTS]))


def test_with_several_objects_only_the_measured_errors_read_ground_truth(several):
    leaking, sensors = leaks(several, stand_in=True)
    assert leaking == []
    assert sensors == set(measured(several, True).values())
    systems, wires = stand_ins(several.vision), Wires(several)
    assert len(systems) == 4
    for number, system in enumerate(systems):
        assert system.num_input_ports() == 1
        source, port = wires.source(system, 0)
        found = f"{source.get_name()}.{source.get_output_port(port).get_name()}"
        assert found == ("object_states.states" if number else "plant.train_state")
    others = {system.get_name() for system in several.vision.GetSystems() if system not in systems}
    assert others == {"tracker", "lag_point", "lag_tracks"}
    for subsystem in controller_subsystems(several).values():
        assert truths(subsystem, is_truth) == {}


def test_with_several_objects_measured_vision_is_a_leak_if_the_scenario_does_not_ask_for_it(several):
    leaking, _ = leaks(several)
    assert any("measured_" in path and "object_states.states" in path for path in leaking), leaking


def test_cameras_that_see_several_objects_give_the_controller_no_ground_truth():
    hand_eye = make_diagram(load_scenario("train:learned", overrides=["vision.method=!SilhouetteTracker {}", OBJECTS]))
    leaking, sensors = leaks(hand_eye)
    assert leaking == []
    assert sensors == set(measured(hand_eye, False).values())
    for subsystem in controller_subsystems(hand_eye).values():
        assert truths(subsystem, is_truth) == {}


def test_a_camera_on_the_hand_gives_the_controller_no_ground_truth():
    hand_eye = make_diagram(load_scenario("train:wrist"))
    leaking, sensors = leaks(hand_eye)
    assert leaking == []
    assert sensors == set(measured(hand_eye, False).values()) and "camera_wrist" in sensors
    for subsystem in controller_subsystems(hand_eye).values():
        assert truths(subsystem, is_truth) == {}


def test_a_leak_in_a_diagram_with_measured_vision_is_found(monkeypatch):
    monkeypatch.setattr(train_diagram, "DiagramBuilder", WorldLeaksToHost)
    leaking, _ = leaks(make_diagram(load_scenario("train:learned", overrides=[MEASURED])), stand_in=True)
    assert any("plant.train_state" in path for path in leaking), leaking


def test_the_only_input_is_the_operator_who_knows_where_the_tool_is(hand_eye):
    assert [hand_eye.get_input_port(k).get_name() for k in range(hand_eye.num_input_ports())] == ["operator"]
    system = OperatorSystem(OperatorPanel())
    assert [system.get_input_port(k).get_name() for k in range(system.num_input_ports())] == ["status"]


def test_only_the_world_has_ports_of_ground_truth_and_their_names_say_so(hand_eye):
    for subsystem in controller_subsystems(hand_eye).values():
        ports = [subsystem.get_input_port(k).get_name() for k in range(subsystem.num_input_ports())]
        ports += [subsystem.get_output_port(k).get_name() for k in range(subsystem.num_output_ports())]
        assert not [name for name in ports if "truth" in name]
    world = hand_eye.world
    names = {world.get_output_port(k).get_name() for k in range(world.num_output_ports())}
    sensors = {"camera_left", "camera_right", "arm_state", "arm_effort", "jaws"}
    assert {name for name in names if not name.startswith("truth_")} == sensors


# Diagrams with leaks, which the search must find.


class Tap(LeafSystem):
    """Outputs its first input one step later, and reads ground truth on its second input, both without feedthrough."""

    def __init__(self, size, truth_size):
        super().__init__()
        self.set_name("tap")
        signal = self.DeclareVectorInputPort("signal", size)
        self.DeclareVectorInputPort("truth", truth_size)
        state = self.DeclareDiscreteState(size)
        self.DeclareStateOutputPort("signal", state)
        self.DeclarePeriodicDiscreteUpdateEvent(
            0.1, 0.0, lambda context, next_state: next_state.set_value(signal.Eval(context))
        )


def tapped(builder, port, truth):
    """Adds a Tap inside two nested diagrams after a port, and returns its output port."""
    inner, outer = DiagramBuilder(), DiagramBuilder()
    tap = inner.AddSystem(Tap(port.size(), truth.size()))
    for name in ("signal", "truth"):
        inner.ExportInput(tap.GetInputPort(name), name)
    inner.ExportOutput(tap.GetOutputPort("signal"), "signal")
    middle = outer.AddNamedSystem("middle", inner.Build())
    for name in ("signal", "truth"):
        outer.ExportInput(middle.GetInputPort(name), name)
    outer.ExportOutput(middle.GetOutputPort("signal"), "signal")
    box = builder.AddNamedSystem("box", outer.Build())
    builder.Connect(port, box.GetInputPort("signal"))
    builder.Connect(truth, box.GetInputPort("truth"))
    return box.GetOutputPort("signal")


class WorldLeaksToHost(DiagramBuilder):
    """The true state of the train leaks into the points that the host reads."""

    def Connect(self, output, input):
        if input.get_name() == "point":
            output = tapped(super(), output, self.GetSubsystemByName("world").GetOutputPort("truth_train_state"))
        super().Connect(output, input)


class VerdictLeaksToArm(DiagramBuilder):
    """The judge's verdict leaks into the packets that the arm reads."""

    def Connect(self, output, input):
        if input.get_name() == "packet" and input.get_system().get_name() == "arm":
            output = tapped(super(), output, self.GetSubsystemByName("world").GetOutputPort("truth_verdict"))
        super().Connect(output, input)


class JawsKnowTheTrain(DiagramBuilder):
    """Inside the world, the state of the train leaks into the measurement of the gripper."""

    def ExportOutput(self, output, name):
        if name == "jaws":
            plant = self.GetSubsystemByName("plant")
            output = tapped(super(), output, plant.get_state_output_port(plant.GetModelInstanceByName("train")))
        return super().ExportOutput(output, name)


@pytest.mark.parametrize(
    "module, builder, source",
    [
        (train_diagram, WorldLeaksToHost, "plant.train_state"),
        (train_diagram, VerdictLeaksToArm, "judge.verdict"),
        (world_module, JawsKnowTheTrain, "plant.train_state"),
    ],
)
def test_a_leak_is_found(monkeypatch, module, builder, source):
    monkeypatch.setattr(module, "DiagramBuilder", builder)
    leaking, _ = leaks(make_diagram(load_scenario("train:learned")))
    assert any(source in path for path in leaking), leaking


# Python references


def is_truth(thing):
    if isinstance(thing, (SceneGraph, TrainScenario, TrainSetup, ConveyorScenario, ConveyorSetup, TrackSettings)):
        return True
    if isinstance(thing, MultibodyPlant):
        return thing.HasModelInstanceNamed("train") or thing.HasModelInstanceNamed("table")
    return type(thing).__module__.startswith("drake_tracker.world")


@pytest.mark.parametrize("subsystem", ["vision", "host", "link", "arm"])
def test_no_object_of_the_controller_refers_to_the_world(hand_eye, subsystem):
    assert truths(controller_subsystems(hand_eye)[subsystem], is_truth) == {}


def test_measured_vision_refers_to_nothing_of_the_world(blind):
    assert truths(blind.vision, is_truth) == {}


def test_the_plant_of_the_controller_is_not_that_of_the_simulator(hand_eye):
    own = hand_eye.arm.model.plant
    assert own is not hand_eye.world.laboratory.plant
    assert any(thing is own for _, thing in references(hand_eye.arm)), "the search did not reach the controller's plant"


@pytest.mark.parametrize(
    "hide",
    [
        lambda truth: {"plant": truth},
        lambda truth: [(0, {"deep": (truth,)})],
        lambda truth: lambda: truth,
        lambda truth: functools.partial(print, truth),
        lambda truth: types.SimpleNamespace(inner=types.SimpleNamespace(value=truth)),
    ],
    ids=["dict", "containers", "closure", "partial", "attributes"],
)
@pytest.mark.parametrize("truth", ["plant", "scene_graph", "laboratory"])
def test_a_hidden_reference_is_found(hand_eye, hide, truth):
    laboratory = hand_eye.world.laboratory
    system = Tap(1, 1)
    assert not any(is_truth(thing) for _, thing in references(system))
    system.hidden = hide(laboratory if truth == "laboratory" else getattr(laboratory, truth))
    assert any(is_truth(thing) for _, thing in references(system))
