"""Measures the real-time factor of whole loops, in process and with processes that render, and of bare ones.

    OPENBLAS_NUM_THREADS=1 python benchmarks/real_time.py [--quick] [--segments N] [--json FILE]
    OPENBLAS_NUM_THREADS=1 python benchmarks/real_time.py --profile
    OPENBLAS_NUM_THREADS=1 LP_NUM_THREADS=1 python benchmarks/real_time.py --watch [--store]

With one thread, as `drake-tracker run` computes.

Loops of the train take turns of one simulated second, so that a busy machine slows all of them. All but the last ones
run the scenario `train`:

- physics: plant, rail and judge; the joint servos hold the arm still, no image is rendered;
- bare: the same, and both cameras' images are read 60 times a second;
- whole: everything, with the hand following the train; nothing is logged or recorded. It renders in process, or with
  one or two processes beside it;
- full images: whole with two processes, and no window around the work volume;
- recorded: whole with one or two processes, and with log, video and 3-D recording as by ``drake-tracker run``;
- train:learned and the others of `LADDER`: whole with one process, in another scenario; `train:guided` also recorded;
- conveyor: whole with one process; it picks its parts.

The first turns do not count: caches are cold and the hand has not found the train. Then runs of the ball, in process
and with one or two processes, take turns in the same way, from the release of the ball on; their initialisation has a
line of its own. `live_cost.py` measures runs with an open page.

Processor time is that of all processes, also of the one that draws the video. ``--profile`` prints where the whole loop
of the train spends its time in the process of the simulation, with two processes that render.

``--watch`` takes less than a minute: it compares the processor time of `train` and the ladder with that of the bare
loop in the same run, which does not depend on how fast the machine is. It warns when a ratio is more than 20 % above
the stored one, and exits with 1 above 50 %. ``--store`` stores the ratios.
"""

import argparse
import cProfile
import json
import os
import pstats
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ImageRgba8U
from result_tables.speed_tables import loops_table, stages_table
from shared.common import RESULTS, print_table, save_json

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.processes.worker_pool import processors
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.run.log_recorder import add_loggers
from drake_tracker.run.options import RunOptions
from drake_tracker.run.recorders import add_recorders
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.train.diagram import make_world
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world.imaging import render_processes
from drake_tracker.world.imaging.cameras import CAMERA_NAMES

TURN = 1.0
"""Simulated time [s] of one turn."""
WARM_UP = 4
"""Turns of the train that do not count."""
BALL_WARM_UP, BALL_TURNS = 1, 4
"""Turns of the ball: one that does not count, and those in which it rolls."""
SEED = 200
LADDER = ("train:learned", "train:guided", "train:wrist", "train:two", "train:visitor", "train:interlaced")
"""Scenarios whose whole loop takes turns with that of `train`."""
WATCH = RESULTS / "speed_watch.json"
WATCH_WARM_UP, WATCH_TURNS = 2, 3
WARNED_FROM, FAILED_FROM = 1.2, 1.5
"""Ratios of today's to the stored ratio from which on ``--watch`` warns and fails."""


class Loop:
    """A simulation that takes turns.

    Args:
        diagram: what is simulated.
        world: whose cameras may have processes; None for none.
        recorders: of the loop; they may have processes.
    """

    def __init__(self, diagram, world=None, recorders=()):
        self.simulator, self._world, self._recorders = Simulator(diagram), world, recorders
        self.turns, self.walls, self.processor = 0, [], []

    def turn(self, counts):
        """Simulates a turn; it ``counts`` or not."""
        before, start = self._processor_time(), time.perf_counter()
        self.turns += 1
        self.simulator.AdvanceTo(self.turns * TURN)
        if counts:
            self.walls.append(time.perf_counter() - start)
            self.processor.append([now - then for now, then in zip(self._processor_time(), before)])

    def close(self):
        """Ends the processes."""
        for recorder in self._recorders:
            recorder.finish(self.simulator.get_context())
        if self._world is not None:
            self._world.close()

    def _processor_time(self):
        """Processor time of this process and of those that record, and of those that render [s]."""
        sensors = {camera.sensor for camera in self._world.cameras.values()} if self._world is not None else set()
        rendering, recording = (
            sum(processor_time_of(number) for part in parts for number in getattr(part, "processes", []))
            for parts in (sensors, self._recorders)
        )
        return time.process_time() + recording, rendering


def processor_time_of(number):
    """Returns the processor time of another process [s], 0 where the system does not tell it."""
    try:
        fields = Path(f"/proc/{number}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Onlooker(LeafSystem):
    """Reads the images of both cameras 60 times a second and discards them."""

    def __init__(self):
        super().__init__()
        self._images = [self.DeclareAbstractInputPort(name, AbstractValue.Make(ImageRgba8U())) for name in CAMERA_NAMES]
        self.DeclarePeriodicPublishEvent(VISION_PERIOD, 0.0, self._look)

    def _look(self, context):
        for image in self._images:
            image.Eval(context)


def bare_loop(scenario, whole, with_images):
    """Returns the world of the whole loop as a Diagram, with its arm held at the start."""
    windows = {name: camera.window for name, camera in whole.world.cameras.items()}
    state = whole.GetOutputPort("arm_state").Eval(whole.CreateDefaultContext())
    model = make_arm_model(PUMA560)
    builder = DiagramBuilder()
    world = builder.AddSystem(make_world(resolve(scenario), windows))
    gravity = builder.AddSystem(InverseDynamics(model.plant, InverseDynamics.InverseDynamicsMode.kGravityCompensation))
    finger = [0.5 * scenario.grasp.jaw_opening, 0.0]
    for name, value in (("arm_desired_state", state), ("gripper_desired_state", finger)):
        builder.Connect(builder.AddSystem(ConstantVectorSource(value)).get_output_port(), world.GetInputPort(name))
    builder.Connect(world.GetOutputPort("arm_state"), gravity.get_input_port_estimated_state())
    builder.Connect(gravity.get_output_port_generalized_force(), world.GetInputPort("arm_feedforward"))
    if with_images:
        onlooker = builder.AddSystem(Onlooker())
        for name in CAMERA_NAMES:
            builder.Connect(world.GetOutputPort(name), onlooker.GetInputPort(name))
    diagram = builder.Build()
    diagram.model = model  # InverseDynamics does not keep its plant alive
    return diagram


def whole_loop(processes, recorded=False, folder=None, name="train", **settings):
    """Returns the whole loop of a scenario as a `Loop`. The hand of the train never grasps."""
    scenario = load_scenario(name, seed=SEED)
    waits = {"grasp.settle_time": 1e6} if scenario.task == "train" else {}
    scenario = scenario.with_settings({**waits, "cameras.render_processes": str(processes), **settings})
    hand_eye = make_diagram(scenario)
    if not recorded:
        return Loop(hand_eye, hand_eye.world)
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    task = task_of(scenario)
    loggers = add_loggers(builder, hand_eye, task)
    Path(folder).mkdir()
    recorders = add_recorders(
        builder,
        hand_eye=hand_eye,
        loggers=loggers,
        scenario=scenario,
        task=task,
        out=Path(folder),
        options=RunOptions(),
    )
    return Loop(builder.Build(), hand_eye.world, recorders)


def take_turns(loops, warm_up, turns):
    """Simulates loops in turns."""
    for turn in range(warm_up + turns):
        for loop in loops.values():
            loop.turn(turn >= warm_up)
    for loop in loops.values():
        loop.close()
    return loops


def measure_train(turns):
    """Returns {name: `Loop`} of the train."""
    whole = whole_loop(0)
    scenario = load_scenario("train", seed=SEED)
    hand_eye = whole.simulator.get_system()
    with tempfile.TemporaryDirectory() as folder:
        loops = {
            "physics": Loop(bare_loop(scenario, hand_eye, with_images=False)),
            "bare, in process": Loop(bare_loop(scenario, hand_eye, with_images=True)),
            "whole, in process": whole,
            "whole, one process": whole_loop(1),
            "whole, two processes": whole_loop(2),
            "full images, two processes": whole_loop(2, **{"cameras.render_window": False}),
            "recorded, one process": whole_loop(1, recorded=True, folder=f"{folder}/one"),
            "recorded, two processes": whole_loop(2, recorded=True, folder=f"{folder}/two"),
            **{name: whole_loop(1, name=name) for name in LADDER},
            "train:guided, recorded": whole_loop(1, recorded=True, folder=f"{folder}/guided", name="train:guided"),
            "conveyor": whole_loop(1, name="conveyor"),
        }
        return take_turns(loops, WARM_UP, turns)


def measure_ball():
    """Returns ({name: `Loop`} of the ball, wall and processor time of the initialisation [s])."""
    scenario = load_scenario("ball", seed=SEED)
    start = time.perf_counter(), time.process_time()
    initialisation = task_of(scenario).initialise(scenario)
    spent = time.perf_counter() - start[0], time.process_time() - start[1]
    loops = {}
    for processes, name in enumerate(("ball, in process", "ball, one process", "ball, two processes")):
        hand_eye = make_diagram(scenario.with_settings({"camera.render_processes": str(processes)}), initialisation)
        loops[name] = Loop(hand_eye, hand_eye.world)
    return take_turns(loops, BALL_WARM_UP, BALL_TURNS), spent


def results_of(loops):
    """Returns {name: numbers of a `Loop`}, per simulated second."""
    return {
        name: {
            "real_time_factor": TURN / np.median(loop.walls),
            "slowest": TURN / max(loop.walls),
            "fastest": TURN / min(loop.walls),
            "processor_s": float(np.mean([sum(spent) for spent in loop.processor])) / TURN,
            "rendering_s": float(np.mean([spent[1] for spent in loop.processor])) / TURN,
        }
        for name, loop in loops.items()
    }


def watch(store):
    """Compares the processor time of each rung with the bare loop's. Returns whether none has become much slower."""
    train, scenario = whole_loop(0), load_scenario("train", seed=SEED)
    loops = {"bare": Loop(bare_loop(scenario, train.simulator.get_system(), with_images=True)), "train": train}
    loops |= {name: whole_loop(0, name=name) for name in LADDER}
    take_turns(loops, WATCH_WARM_UP, WATCH_TURNS)
    spent = {name: min(sum(turn) for turn in loop.processor) for name, loop in loops.items()}
    ratios = {name: seconds / spent["bare"] for name, seconds in spent.items()}
    if store:
        save_json({"ratios": ratios}, WATCH, [SEED])
        return True
    stored = json.loads(WATCH.read_text(encoding="utf-8"))["ratios"]
    for name, ratio in ratios.items():
        slower = ratio / stored[name]
        verdict = "FAILED" if slower > FAILED_FROM else "WARNING" if slower > WARNED_FROM else "as stored"
        print(f"speed: {name} costs {ratio:.2f} x the bare loop, stored {stored[name]:.2f}: {verdict}")
    return all(ratio <= FAILED_FROM * stored[name] for name, ratio in ratios.items())


def profile():
    """Prints where the whole loop spends its time."""
    loop = whole_loop(2)
    for _ in range(WARM_UP):
        loop.turn(False)
    profiler = cProfile.Profile()
    profiler.enable()
    for _ in range(5):
        loop.turn(False)
    profiler.disable()
    loop.close()
    pstats.Stats(profiler).sort_stats("tottime").print_stats(40)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=20, help="counted turns of each loop of the train")
    parser.add_argument("--quick", action="store_true", help="5 turns")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    parser.add_argument("--watch", action="store_true", help="compare with the stored ratios instead")
    parser.add_argument("--store", action="store_true", help="with --watch: store the ratios")
    parser.add_argument("--profile", action="store_true", help="print where the time goes instead")
    options = parser.parse_args()
    if options.profile:
        profile()
        return
    if options.watch:
        sys.exit(0 if watch(options.store) else 1)
    render_processes.MOST_RUNNING = 20  # all loops keep theirs from turn to turn
    train = results_of(measure_train(5 if options.quick else options.segments))
    ball, (wall, processor) = measure_ball()
    results = {
        "processors": processors(),
        "loops": {**train, **results_of(ball)},
        "ball_initialisation": {"wall_s": wall, "processor_s": processor},
    }
    print_table(*loops_table(results))
    print_table(*stages_table(results))
    save_json(results, options.json, [SEED])


if __name__ == "__main__":
    main()
