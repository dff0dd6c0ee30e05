import numpy as np
import pytest
from ball_scenario import true_poses
from conveyor_world import HEIGHT, KINDS, World, arrival
from pydrake.geometry import Role
from pydrake.systems.analysis import Simulator

from drake_tracker import make_diagram
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.conveyor.setup import resolve
from drake_tracker.tasks.loader import load_scenario
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import BeltConfig, TrayConfig, cell_centres
from drake_tracker.world.conveyor.part_fates import PartFate
from drake_tracker.world.conveyor.part_model import rest_height
from drake_tracker.world.conveyor.sleeping_parts import BEFORE_ENTRY, BEYOND_END, LIFT, free_stretch
from drake_tracker.world.imaging.cameras import true_camera_models

BELT = BeltConfig(speed=0.4)


class Held(World):
    """A world whose parts are held when nothing can move them, once per vision cycle."""

    def advance(self, time):
        while self.context.get_time() < time - 1e-9:
            self.diagram.between_steps(self.context)
            self.simulator.AdvanceTo(min(self.context.get_time() + VISION_PERIOD, time))

    @property
    def locked(self):
        plant = self.diagram.laboratory.plant
        context = plant.GetMyContextFromRoot(self.context)
        bodies = self.diagram.laboratory.parts
        return [plant.GetJointByName(body.name(), body.model_instance()).is_locked(context) for body in bodies]


def test_parts_come_to_the_same_places_whether_they_are_held_or_not():
    parts = [arrival(time, kind, yaw=yaw) for time, kind, yaw in zip((0.2, 1.4, 1.8), KINDS, (0.3, 2.0, 4.0))]
    free, held = World(parts, belt=BELT), Held(parts, belt=BELT)
    first = BELT.entry - BEFORE_ENTRY
    held.advance(0.5)
    assert held.locked == [False, True, True]
    places, travelled = held.states, held.diagram.motion.distance(0.5)
    for k in (1, 2):  # at their places, up to the way of the belt in one cycle, and off the belt by the lift
        y = BELT.entry - held.diagram.motion.distance(parts[k].time) + travelled
        assert y - 1.01 * BELT.speed * VISION_PERIOD <= places[k, 5] <= y < first
        assert places[k, 6] == pytest.approx(HEIGHT + rest_height(parts[k].kind) + LIFT, abs=1e-6)
        assert not places[k, 7:].any()
    held.advance(2.0)
    free.simulator.AdvanceTo(2.0)
    assert held.locked == [False, False, False] and held.fates == free.fates == [PartFate.ON_BELT] * 3
    assert held.states == pytest.approx(free.states, abs=5e-5)


def test_a_missed_part_leaves_for_the_box_where_it_is_still_missed():
    held = Held([arrival(20.0), arrival(21.0)], belt=BELT)
    held.put(1, [0.60, BELT.end - 0.02, HEIGHT + 0.015])
    held.advance(0.6)
    assert held.fates[0] is PartFate.MISSED and held.locked == [False, True]
    held.advance(1.5)
    assert held.fates[0] is PartFate.MISSED and held.locked == [True, True]
    assert held.states[0, 5] > BELT.end + BEYOND_END and held.states[0, 6] < 0.05 and not held.states[0, 7:].any()
    assert held.verdict.missed == 1.0


def test_a_part_sleeps_in_its_cell_while_the_fingers_are_far_away():
    cells = cell_centres(TrayConfig())
    near, far = cells[1], cells[len(cells) // 2]
    held = Held([arrival(20.0), arrival(21.0)], p_WT=[*cells[0], HEIGHT + 0.1])
    for number, cell in ((1, near), (2, far)):
        held.put(number, [*cell, HEIGHT + rest_height(KINDS[0])], yaw=0.5 * np.pi)
    before = held.states
    held.advance(0.4)
    assert held.fates == [PartFate.PLACED] * 2 and held.locked == [False, True]
    assert held.states[:, :7] == pytest.approx(before[:, :7], abs=1e-4)
    plant, arm = held.diagram.laboratory.plant, held.diagram.laboratory.arm
    context = plant.GetMyMutableContextFromRoot(held.context)
    q = plant.GetPositions(context, arm)
    plant.SetPositions(context, arm, [q[0] - 2.0 * np.arctan2(cells[0][1], cells[0][0]), *q[1:]])
    held.diagram.between_steps(held.context)
    assert held.locked == [True, False]


def test_a_part_can_lie_on_one_that_sleeps():
    cell, half = cell_centres(TrayConfig())[0], rest_height(KINDS[0])
    held = Held([arrival(20.0), arrival(0.5)])
    held.put(1, [*cell, HEIGHT + half])
    held.advance(0.4)
    assert held.locked == [True, False]
    held.put(2, [*cell, HEIGHT + 3.0 * half + 0.002])
    held.simulator.AdvanceTo(0.7)
    assert held.states[:, 6] == pytest.approx([HEIGHT + half, HEIGHT + 3.0 * half], abs=5e-4)


def test_a_part_that_something_has_moved_is_not_held():
    held = Held([arrival(20.0), arrival(21.0)])
    held.put(1, [0.62, -2.0, HEIGHT + 0.015])
    held.advance(0.1)
    assert held.locked == [False, True]


def test_all_memory_is_in_the_context():
    parts = [arrival(time) for time in (0.6, 1.2, 2.5)]
    held = Held(parts, belt=BELT)
    held.advance(0.7)
    copy = Held(parts, belt=BELT)
    copy.diagram = held.diagram
    copy.simulator = Simulator(held.diagram, held.context.Clone())
    copy.context = copy.simulator.get_mutable_context()
    assert copy.locked == held.locked == [False, True, True]
    for world in (held, copy):
        world.advance(1.3)
    assert copy.locked == held.locked and (copy.states == held.states).all()


@pytest.mark.parametrize("overrides", [[], ["cameras.render_window=false"]])
def test_parts_are_free_wherever_an_image_shows_the_belt(overrides):
    scenario = load_scenario("conveyor", overrides=overrides)
    cameras = true_camera_models(scenario.cameras)
    windows = {f"camera_{side}": window for side, window in resolve(scenario).windows.items()}
    belt = scenario.belt
    first, last = free_stretch(belt, cameras, windows)
    assert first <= belt.entry - BEFORE_ENTRY and last >= belt.end + BEYOND_END
    assert free_stretch(belt, {}) == (belt.entry - BEFORE_ENTRY, belt.end + BEYOND_END)
    random = np.random.default_rng(0)
    low, high = [belt.middle - 0.5 * belt.width, -3.0, belt.height], [belt.middle + 0.5 * belt.width, 3.0, 0.5]
    points = random.uniform(low, high, (20000, 3))
    for name, camera in cameras.items():
        u0, v0, width, height = windows[name]
        u, v = camera.project(points).T
        seen = points[(u >= u0) & (u < u0 + width) & (v >= v0) & (v < v0 + height), 1]
        assert len(seen) > 1000 and first < seen.min() - 0.05 and seen.max() + 0.05 < last


def test_no_part_near_the_fingers_is_held():
    belt = BeltConfig(speed=0.4, entry=0.0)
    motion = make_belt_motion(belt)
    parts = [arrival(motion.time_at(distance)) for distance in (0.3, 0.6)]
    held = Held(parts, p_WT=[0.60, -0.3, HEIGHT + 0.08], belt=belt)
    held.diagram.between_steps(held.context)
    assert held.locked == [False, True]
    # A held part that comes near the fingers is put down, and rides on.
    held = Held(parts, p_WT=[0.60, -0.05, HEIGHT + 0.08], belt=belt)
    held.diagram.between_steps(held.context)
    assert held.locked == [True, True]
    held.advance(0.6)
    y, travelled = held.states[0, 5], motion.distance(0.6)
    assert y < belt.entry - BEFORE_ENTRY and held.locked == [False, True]
    assert y == pytest.approx(travelled - 0.3, abs=5e-5)


def test_a_part_falls_to_the_floor_while_another_is_locked():
    """Contact with geometry of the world body crashed Drake while a joint was locked (Drake issue 24773)."""
    held = Held([arrival(0.1, x=0.95), arrival(25.0)])
    held.advance(1.0)
    assert held.locked == [False, True]
    assert held.states[0, 6] < 0.1, "it lies on the floor"


@pytest.mark.parametrize("name", ["train", "ball", "conveyor:measured"])
def test_no_geometry_of_the_world_body_takes_part_in_contacts(name):
    scenario = load_scenario(name)
    world = make_diagram(scenario, true_poses(scenario) if name == "ball" else None).world
    plant, inspector = world.laboratory.plant, world.laboratory.scene_graph.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(plant.world_body().index())
    assert not inspector.GetGeometries(frame, Role.kProximity)
