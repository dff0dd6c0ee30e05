"""Late cameras on a scene that is not the package's own: bodies that move, a fixed camera, and one that is carried."""

import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    Box,
    Capsule,
    ClippingRange,
    ColorRenderCamera,
    Cylinder,
    DepthRange,
    DepthRenderCamera,
    Ellipsoid,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import CameraInfo, ImageRgba8U, RgbdSensor

from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.core.processes import child_process
from drake_tracker.world.imaging import render_processes
from drake_tracker.world.imaging.image_pipeline import VARIABLE, process_count
from drake_tracker.world.imaging.pipelined_camera_system import CameraMount, add_pipelined_camera
from drake_tracker.world.imaging.sensor_model import SensorModel, SensorNoise

PERIOD, TIME_STEP, LATENCY = 1 / 64, 1 / 512, 3
SIZE = (64, 48)
PARAMS = RenderEngineVtkParams()


CAMERAS = ("fixed", "carried")


class Witness(LeafSystem):
    """Keeps the images of both kinds of cameras, read at the instants of the captures."""

    def __init__(self):
        super().__init__()
        self.now, self.late = [], []
        for name in CAMERAS:
            self.DeclareAbstractInputPort(f"now_{name}", AbstractValue.Make(ImageRgba8U(*SIZE)))
            self.DeclareAbstractInputPort(f"late_{name}", AbstractValue.Make(ImageRgba8U(*SIZE)))
        self.DeclarePeriodicPublishEvent(PERIOD, 0.0, self.look)

    def look(self, context):
        for when, kept in (("now", self.now), ("late", self.late)):
            kept.append({name: self.GetInputPort(f"{when}_{name}").Eval(context).data.copy() for name in CAMERAS})


class Scene:
    """A turning arm that carries a camera, and coloured shapes; the floor and a sheet on it are in the same place."""

    def __init__(self, latency=LATENCY, processes=1, with_sensors=False, sensor=SensorModel(), **options):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, TIME_STEP)
        arm = plant.AddRigidBody("arm", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.5))
        swing = plant.AddJoint(RevoluteJoint("swing", plant.world_frame(), arm.body_frame(), [0, 1, 0]))
        for number, shape in enumerate((Box(0.2, 0.1, 0.1), Sphere(0.1), Cylinder(0.05, 0.3), Capsule(0.05, 0.2))):
            X_WG = RigidTransform(RollPitchYaw(0.3, 0.2, number), [0.5, 0.25 * number - 0.4, 0.1])
            colour = [0.2 + 0.2 * number, 0.9 - 0.2 * number, 0.5, 1.0]
            plant.RegisterVisualGeometry(plant.world_body(), X_WG, shape, f"shape_{number}", colour)
            plant.RegisterCollisionGeometry(plant.world_body(), X_WG, shape, f"body_{number}", CoulombFriction())
        for name, colour in (("floor", [0.3, 0.3, 0.3, 1]), ("sheet", [0.8, 0.2, 0.2, 1])):
            plant.RegisterVisualGeometry(
                plant.world_body(), RigidTransform([0, 0, -0.3]), Box(3, 3, 0.01), name, colour
            )
        plant.RegisterVisualGeometry(
            arm, RigidTransform([0.0, 0.0, -0.3]), Ellipsoid(0.05, 0.05, 0.1), "bob", [1, 1, 0, 1]
        )
        plant.Finalize()
        core = RenderCameraCore("vtk", CameraInfo(*SIZE, 1.0), ClippingRange(0.05, 10.0), RigidTransform())
        camera = ColorRenderCamera(core)
        frame = plant.GetBodyFrameIdOrThrow(arm.index())
        facing = RollPitchYaw(-np.pi / 2, 0.0, -np.pi / 2)
        mounts = {
            "fixed": CameraMount(camera, RigidTransform(facing, [-0.8, 0.0, 0.0]), sensor=sensor),
            "carried": CameraMount(camera, RigidTransform(facing, [-0.1, 0.0, -0.2]), frame, sensor),
        }
        self.late = add_pipelined_camera(
            builder,
            scene_graph=scene_graph,
            cameras=mounts,
            params=PARAMS,
            latency=latency,
            processes=processes,
            period=PERIOD,
            **options,
        )
        self.sensors, self.witness = {}, None
        if with_sensors:
            scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(PARAMS))
            depth = DepthRenderCamera(core, DepthRange(0.1, 5.0))
            for name, mount in mounts.items():
                parent = mount.parent or scene_graph.world_frame_id()
                self.sensors[name] = builder.AddSystem(RgbdSensor(parent, mount.X_PB, camera, depth))
                builder.Connect(scene_graph.get_query_output_port(), self.sensors[name].query_object_input_port())
            self.witness = builder.AddSystem(Witness())
            for name, sensor in self.sensors.items():
                builder.Connect(sensor.color_image_output_port(), self.witness.GetInputPort(f"now_{name}"))
                builder.Connect(self.late.GetOutputPort(name), self.witness.GetInputPort(f"late_{name}"))
        self.simulator = Simulator(builder.Build())
        self.context = self.simulator.get_mutable_context()
        swing.set_angular_rate(plant.GetMyMutableContextFromRoot(self.context), 2.0)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.late.close()

    def images_at(self, time):
        self.simulator.AdvanceTo(time)
        return self.images()

    def images(self, context=None):
        context = self.late.GetMyContextFromRoot(context or self.context)
        return {name: self.late.GetOutputPort(name).Eval(context).data.copy() for name in CAMERAS}


def assert_same(first, second):
    assert set(first) == set(second)
    for name, image in first.items():
        np.testing.assert_array_equal(image, second[name])


@pytest.mark.parametrize("processes", [0, 1, 2])
def test_each_image_is_that_of_an_rgbd_sensor_some_cycles_earlier(processes):
    with Scene(processes=processes, with_sensors=True) as scene:
        scene.simulator.AdvanceTo(9.5 * PERIOD)
        now, late = scene.witness.now, scene.witness.late
        assert len(now) == len(late) == 10
        for cycle, images in enumerate(late):
            if cycle < LATENCY:
                assert not any(image.any() for image in images.values()), "black before there is an image"
            else:
                assert_same(images, now[cycle - LATENCY])
        assert all((now[0][name] != now[9][name]).any() for name in CAMERAS)


def test_an_image_depends_on_the_context_alone():
    """Contexts that were cloned, set back, or come from a simulation whose processes never saw them."""
    with Scene() as scene, Scene() as other:
        scene.simulator.AdvanceTo(10.2 * PERIOD)
        early, early_images = scene.context.Clone(), scene.images()
        scene.simulator.AdvanceTo(40.2 * PERIOD)
        late_images = scene.images()
        assert (late_images["fixed"] != early_images["fixed"]).any()
        assert_same(scene.images(early), early_images)
        foreign = other.simulator.get_system().CreateDefaultContext()
        foreign.SetTimeStateAndParametersFrom(early)
        assert_same(other.images(foreign), early_images)
        scene.context.SetTimeStateAndParametersFrom(early)
        assert_same(scene.images(), early_images)
        scene.simulator.Initialize()
        scene.simulator.AdvanceTo(40.2 * PERIOD)
        assert_same(scene.images(), late_images)


def test_images_that_are_captured_but_not_due_can_be_read_by_setting_the_time():
    with Scene() as scene:
        scene.simulator.AdvanceTo(10.2 * PERIOD)
        ahead = scene.context.Clone()
        ahead.SetTime(13 * PERIOD)
        found = scene.images(ahead)
        scene.simulator.AdvanceTo(13.2 * PERIOD)
        assert_same(scene.images(), found)


@pytest.mark.parametrize("processes", [0, 1])
def test_the_sensor_adds_the_noise_of_the_captured_frame(processes):
    noise = SensorNoise(*SIZE, std=4.0, flicker=0.1, period=PERIOD, seed=5)
    with Scene(processes=processes, sensor=SensorModel(noise=noise)) as scene, Scene(processes=0) as plain:
        for each in (scene, plain):
            each.simulator.AdvanceTo(9.2 * PERIOD)
        expected = np.empty((*SIZE[::-1], 4), np.uint8)
        noise.add(plain.images()["fixed"], 6 * PERIOD, expected)
        np.testing.assert_array_equal(scene.images()["fixed"], expected)


def test_images_that_nobody_wants_are_made_only_when_they_are_read():
    with Scene(wanted=lambda cycle: cycle % 4 == 0) as scene, Scene(processes=0) as plain:
        asked = []
        ask = scene.late._processes.ask
        scene.late._processes.ask = lambda request: asked.append(round(request[1] / PERIOD)) or ask(request)
        for each in (scene, plain):
            each.simulator.AdvanceTo(8.2 * PERIOD)
        assert sorted(set(asked)) == [0, 4, 8]
        assert_same(scene.images(), plain.images())


def test_without_latency_an_image_is_that_of_the_present():
    with Scene(latency=0, processes=0, with_sensors=True) as scene:
        scene.simulator.AdvanceTo(5.5 * PERIOD)
        for late, now in zip(scene.witness.late, scene.witness.now, strict=True):
            assert_same(late, now)


def alive(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def wait_until(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def test_a_killed_process_is_named_in_one_line_and_replaced_after_closing():
    with Scene(processes=2) as scene:
        assert scene.late.processes == [], "they start with the first image"
        scene.simulator.AdvanceTo(5.2 * PERIOD)
        before = scene.images()
        for number in scene.late.processes:
            os.kill(number, signal.SIGKILL)
        with pytest.raises(MachineError, match=r"^a render process was ended by signal 9; .*render_processes"):
            scene.images_at(20 * PERIOD)
        scene.late.close()
        assert scene.late.processes == []
        with Scene(processes=0) as plain:
            plain.simulator.AdvanceTo(5.2 * PERIOD)
            context = scene.simulator.get_system().CreateDefaultContext()
            context.SetTimeStateAndParametersFrom(plain.context)
        assert_same(scene.images(context), before)


def test_processes_end_with_close_and_with_the_system():
    scene = Scene()
    scene.simulator.AdvanceTo(2.2 * PERIOD)
    (number,) = scene.late.processes
    scene.late.close()
    assert not alive(number)
    scene.simulator.AdvanceTo(5.2 * PERIOD)
    (number,) = scene.late.processes
    scene.late._processes = None
    gc.collect()
    assert not alive(number)


def test_only_so_many_run_at_the_same_time(monkeypatch):
    """Drake does not always release a diagram that is no longer used."""
    monkeypatch.setattr(render_processes, "MOST_RUNNING", 1)
    with Scene() as first, Scene() as second:
        first.simulator.AdvanceTo(5.2 * PERIOD)
        (number,) = first.late.processes
        second.simulator.AdvanceTo(5.2 * PERIOD)
        assert first.late.processes == [] and not alive(number)
        assert len(second.late.processes) == 1
        assert_same(first.images_at(6.2 * PERIOD), second.images_at(6.2 * PERIOD))


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from test_pipelined_camera_system import PERIOD, Scene
scene = Scene(processes=2)
scene.simulator.AdvanceTo(4 * PERIOD)
print(*scene.late.processes, flush=True)
input()
"""
"""A script without a guard for the main module, as in a notebook."""


@pytest.mark.parametrize("ending", ["at its end", signal.SIGKILL, signal.SIGINT])
def test_no_process_outlives_the_program(ending):
    child = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(tests=str(Path(__file__).parent))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    numbers = [int(word) for word in child.stdout.readline().split()]
    assert len(numbers) == 2 and all(map(alive, numbers))
    if ending == "at its end":
        child.stdin.write("\n")
        child.stdin.flush()
    else:
        os.killpg(child.pid, ending)
    child.wait(20)
    assert wait_until(lambda: not any(map(alive, numbers)))
    child.stdin.close()
    child.stdout.close()


def test_processes_that_cannot_start_are_named_in_one_line(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with Scene() as scene, pytest.raises(MachineError, match="^a render process cannot start: No such file"):
        scene.simulator.AdvanceTo(0.1)


def test_too_little_memory_is_named_in_one_line(monkeypatch):
    def full(descriptor, offset, size):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(render_processes.os, "posix_fallocate", full)
    with Scene() as scene, pytest.raises(MachineError, match="^no memory for rendered images: No space left"):
        scene.simulator.AdvanceTo(0.1)


def test_an_error_in_a_process_is_named_in_one_line(monkeypatch):
    with Scene() as scene:
        task = scene.late._processes._task
        scene.late._processes._task = task[:-20]
        with pytest.raises(MachineError, match="^a render process (failed|ended)") as error:
            scene.images_at(0.2)
        assert "\n" not in str(error.value)


def test_a_process_that_does_not_answer_is_named_in_one_line(monkeypatch):
    monkeypatch.setattr(child_process, "PATIENCE", 0.3)
    with Scene() as scene:
        scene.simulator.AdvanceTo(1.5 * PERIOD)
        (number,) = scene.late.processes
        os.kill(number, signal.SIGSTOP)
        try:
            with pytest.raises(MachineError, match=r"^a render process did not answer within 0\.3 s"):
                scene.images_at(1.0)
        finally:
            os.kill(number, signal.SIGCONT)


@pytest.mark.parametrize(
    ("options", "message"), [({"latency": -1}, "latency is -1"), ({"processes": -1}, "processes is -1")]
)
def test_arguments_out_of_range_are_refused(options, message):
    with pytest.raises(DrakeTrackerError, match=message):
        Scene(**options)


def test_the_number_of_processes_is_a_setting_a_variable_or_the_machines(monkeypatch):
    monkeypatch.setenv(VARIABLE, "1")
    assert [process_count(setting) for setting in ("auto", "0", 2)] == [1, 0, 2]
    monkeypatch.setenv(VARIABLE, "many")
    with pytest.raises(DrakeTrackerError, match=f"{VARIABLE} is 'many'; it must be one of auto, 0, 1, 2"):
        process_count("auto")
    monkeypatch.delenv(VARIABLE)
    for processors, expected in ((1, 0), (2, 1), (3, 2), (64, 2)):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _, n=processors: set(range(n)), raising=False)
        assert process_count("auto") == expected


def test_when_one_of_two_cannot_start_none_is_left(monkeypatch):
    start, started = subprocess.Popen, []

    def second_fails(*arguments, **options):
        if started:
            raise OSError(11, "Resource temporarily unavailable")
        started.append(start(*arguments, **options))
        return started[0]

    monkeypatch.setattr(child_process.subprocess, "Popen", second_fails)
    gc.collect()
    open_files = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    with Scene(processes=2) as scene:
        with pytest.raises(MachineError, match="^a render process cannot start: Resource temporarily"):
            scene.late.start()
        assert scene.late.processes == [] and not alive(started[0].pid)
        gc.collect()
        assert not open_files or len(os.listdir("/proc/self/fd")) == open_files
        monkeypatch.undo()
        assert scene.images_at(5.2 * PERIOD)["fixed"].any(), "it can be tried again"
