from dataclasses import replace

import cv2
import numpy as np
import pytest
from conveyor_world import HEIGHT, KINDS, OVER_BELT, World, arrival
from variants import variant

from drake_tracker.core.colour import rgb
from drake_tracker.core.messages import EncoderReading, JawState
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind, part_outline
from drake_tracker.faults.config import EncoderJump, EncoderStopped, HandOverBelt
from drake_tracker.faults.kinds import make_faults
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.conveyor.belt_system import ENCODER_STEP
from drake_tracker.world.conveyor.conveyor_config import BELT_MOTIONS, BeltConfig, TrayConfig, cell_centres
from drake_tracker.world.conveyor.part_fates import PartFate
from drake_tracker.world.conveyor.part_model import feet, lying_height, part_inertia, rest_height
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, true_camera_models


def test_ports():
    for encoder in (False, True):
        world = World([arrival(1.0)], belt=BeltConfig(encoder=encoder)).diagram
        outputs = [world.get_output_port(k).get_name() for k in range(world.num_output_ports())]
        assert outputs == [
            *("arm_state", "arm_effort", "jaws"),
            *(["encoder"] if encoder else []),
            *("truth_part_states", "truth_verdict", "truth_fates", "truth_query"),
        ]
    inputs = [world.get_input_port(k).get_name() for k in range(world.num_input_ports())]
    assert inputs == ["arm_desired_state", "arm_feedforward", "gripper_desired_state"]


@pytest.mark.parametrize("motion", BELT_MOTIONS)
def test_the_belt_carries_parts_without_slip(motion):
    belt = variant(BeltConfig, first_duration=0.8, second_duration=0.4, second_speed=0.4)(motion=motion, encoder=True)
    parts = [arrival(time, kind, 0.57, yaw) for time, kind, yaw in zip((0.5, 1.0, 2.0), KINDS, (0.2, 1.0, 4.0))]
    world = World(parts, belt=belt)
    before = world.states
    world.simulator.AdvanceTo(3.0)
    after, travelled = world.states, world.diagram.motion.distance(3.0)
    assert after[:, 5] - before[:, 5] == pytest.approx(np.full(3, travelled), abs=5e-5)
    assert after[:, 4] == pytest.approx(np.full(3, 0.57), abs=2e-6)
    assert after[:, 6] == pytest.approx([HEIGHT + rest_height(kind) for kind in KINDS], abs=2e-5)
    assert np.abs(after[:, :4] - before[:, :4]).max() < 2e-5  # neither tipped nor turned
    reading = EncoderReading(world.read("encoder"))
    assert reading.time == 3.0 and reading.valid == 1.0
    assert reading.distance == pytest.approx(travelled, abs=1.1 * ENCODER_STEP)
    assert reading.distance / ENCODER_STEP == pytest.approx(round(reading.distance / ENCODER_STEP), abs=1e-6)


def test_a_part_passes_the_entry_when_it_arrives():
    world = World([arrival(2.0)])
    world.simulator.AdvanceTo(2.0)
    assert world.states[0, 5] == pytest.approx(BeltConfig().entry, abs=5e-5)


def test_the_judge_tells_where_parts_are():
    world = World([arrival(20.0 + 2.0 * k, KINDS[k % 3]) for k in range(8)])
    centres = cell_centres(TrayConfig())
    for number, place in ((1, [*centres[0], HEIGHT]), (2, [*centres[13], HEIGHT]), (3, [0.45, 0.0, HEIGHT - 0.03])):
        kind = world.diagram.arrivals[number - 1].kind
        world.put(number, np.add(place, [0.0, 0.0, rest_height(kind)]), yaw=0.5 * np.pi)
    world.put(4, [0.60, 0.55, HEIGHT + 0.015])
    world.put(5, [0.60, 0.30, HEIGHT + 0.0125])
    world.put(7, [1.2, 0.0, 0.015])
    world.put(8, [0.5 * (centres[0, 0] + centres[1, 0]), 0.19 + 0.065, HEIGHT + 0.0125 + 0.004])  # on a wall
    world.simulator.AdvanceTo(0.7)
    assert world.fates == [
        *(PartFate.PLACED, PartFate.PLACED, PartFate.DROPPED, PartFate.MISSED),
        *(PartFate.ON_BELT, PartFate.UPSTREAM, PartFate.DROPPED, PartFate.DROPPED),
    ]
    verdict = world.verdict
    assert (verdict.arrived, verdict.placed, verdict.missed, verdict.dropped) == (7.0, 2.0, 1.0, 3.0)
    assert verdict.picked == verdict.held == verdict.doubles == 0.0
    assert not (verdict.belt_touched or verdict.tray_touched or verdict.table_touched or verdict.self_touched)


@pytest.mark.parametrize("kind", KINDS)
def test_the_fingers_hold_every_kind(kind):
    width = PART_SHAPES[kind].width
    world = World([arrival(10.0), arrival(20.0, kind)], opening=width + 0.001)
    world.put(2, np.add(OVER_BELT, [0.0, 0.0, -0.004]), yaw=np.pi)
    world.fix("gripper_desired_state", [0.0, 0.0])
    world.simulator.AdvanceTo(0.3)
    assert world.fates == [PartFate.UPSTREAM, PartFate.HELD]
    assert (world.verdict.held, world.verdict.picked, world.verdict.doubles) == (2.0, 1.0, 0.0)
    assert JawState(world.read("jaws")).width == pytest.approx(width, abs=5e-4)
    z = world.states[1, 6]
    world.simulator.AdvanceTo(0.6)
    assert world.states[1, 6] == pytest.approx(z, abs=5e-4)
    world.fix("gripper_desired_state", [0.044, 0.0])
    world.simulator.AdvanceTo(1.2)
    assert world.fates[1] is PartFate.DROPPED and world.verdict.held == 0.0


def test_two_parts_between_the_fingers_are_a_double():
    world = World([arrival(10.0), arrival(20.0)], opening=0.061)
    for number, across in ((1, 0.0151), (2, -0.0151)):
        world.put(number, np.add(OVER_BELT, [0.0, across, 0.0]), yaw=np.pi)
    world.fix("gripper_desired_state", [0.0, 0.0])
    world.simulator.AdvanceTo(0.2)
    assert world.verdict.doubles == 1.0 and world.verdict.picked == 2.0


@pytest.mark.parametrize(
    "place, touched",
    [
        ([0.60, 0.0, HEIGHT + 0.0125], "belt_touched"),
        ([0.410, 0.19, HEIGHT + 0.0125], "tray_touched"),
        ([0.45, 0.0, HEIGHT - 0.03 + 0.0125], "table_touched"),
    ],
)
def test_the_judge_tells_what_the_arm_touches(place, touched):
    world = World([arrival(10.0)], p_WT=place, opening=0.04)
    world.simulator.AdvanceTo(0.05)
    names = ("belt_touched", "tray_touched", "table_touched", "self_touched")
    assert {name for name in names if getattr(world.verdict, name)} == {touched}


@pytest.mark.parametrize("kind", KINDS)
def test_a_part_stands_on_feet_inside_its_outline(kind):
    outline = (1e4 * part_outline(kind)).astype(np.float32)
    inside = [cv2.pointPolygonTest(outline, (1e4 * foot).tolist(), True) for foot in feet(kind)]
    assert len(inside) >= 4 and min(inside) > 25.0  # 2.5 mm
    assert 0.06 < part_inertia(kind).get_mass() < 0.1
    centre = part_inertia(kind).get_com()[:2]
    hull = cv2.convexHull(feet(kind).astype(np.float32))
    assert cv2.pointPolygonTest(hull, centre.tolist(), True) > 0.004


def test_the_cameras_see_the_parts_where_they_are():
    cameras = CamerasConfig(noise=0.0, fov_deg=45.0, look_at=(0.5, 0.0, HEIGHT))
    colours = ("#d8573c", "#3f8fd0")
    world = World(
        [arrival(20.0, colour=colours[0]), arrival(21.0, colour=colours[1])], [0.45, 0.0, 0.75], cameras=cameras
    )
    places = ([0.62, 0.12, HEIGHT + 0.015], [0.58, -0.10, HEIGHT + 0.015])
    for number, place in enumerate(places, start=1):
        world.put(number, place)
    models = true_camera_models(cameras)
    for name in CAMERA_NAMES:
        image = world.read(name).data[..., :3] / 255.0
        for place, colour in zip(places, colours):
            hue = rgb(colour) / np.linalg.norm(rgb(colour))
            alike = (image @ hue > 0.97 * np.linalg.norm(image, axis=2)) & (image.max(axis=2) > 0.3)
            u, v = models[name].project(place)[0]
            low, high = np.array([v, u]).astype(int) - 10, np.array([v, u]).astype(int) + 11
            rows, columns = np.nonzero(alike[low[0] : high[0], low[1] : high[1]])
            assert len(rows) > 20, name
            seen = [columns.mean() + low[1], rows.mean() + low[0]]
            assert seen == pytest.approx([u, v], abs=2.0)


@pytest.mark.parametrize("kind", [PartKind.BOX, PartKind.ELL])
def test_a_part_that_lies_on_a_side_stays_so_and_rides_with_the_belt(kind):
    world = World([replace(arrival(0.5, kind), lies=True)])
    before = world.states
    world.simulator.AdvanceTo(2.0)
    after = world.states
    assert after[0, 6] == pytest.approx(HEIGHT + lying_height(kind), abs=5e-5)
    assert np.abs(after[0, :4] - before[0, :4]).max() < 1e-3
    assert after[0, 5] - before[0, 5] == pytest.approx(world.diagram.motion.distance(2.0), abs=5e-4)


@pytest.mark.parametrize("settings, wrong", [(EncoderJump(at=0.5, distance=0.3), 0.3), (EncoderStopped(at=0.5), None)])
def test_an_encoder_with_a_fault(settings, wrong):
    world = World([arrival(1.0)], belt=BeltConfig(encoder=True), faults=make_faults([settings], seed=0))
    distance = world.diagram.motion.distance
    for time, expected in ((0.4, distance(0.4)), (1.0, distance(0.5) if wrong is None else distance(1.0) + wrong)):
        world.simulator.AdvanceTo(time)
        assert EncoderReading(world.read("encoder")).distance == pytest.approx(expected, abs=1.1 * ENCODER_STEP)


def test_a_hand_reaches_over_the_belt_and_touches_nothing():
    (fault,) = make_faults([HandOverBelt(at=0.5, duration=3.0, y=0.1)], seed=0)
    world = World([arrival(1.0)], faults=[fault])
    plant = world.diagram.laboratory.plant
    hand = plant.GetBodyByName("hand_0")
    tip = []
    for time in (0.4, 1.5):
        world.simulator.AdvanceTo(time)
        tip.append(hand.EvalPoseInWorld(plant.GetMyContextFromRoot(world.context)).translation() - [0.2, 0.0, 0.0])
    belt = BeltConfig()
    assert tip[0][0] > belt.middle + 0.5 * belt.width and tip[1][0] == pytest.approx(belt.middle - 0.02, abs=0.003)
    assert tip[1][1] == pytest.approx(0.1) and plant.GetCollisionGeometriesForBody(hand) == []
