"""Measures the real-time factor of the whole loop, and of a bare loop of the same plant, rail and cameras.

    python benchmarks/real_time.py [--quick] [--segments N] [--json FILE]

Three loops of the default scenario take turns of one simulated second, so that a busy machine slows all of them:

- physics: plant, rail and judge; the joint servos hold the arm still, no image is rendered;
- bare: the same, and both cameras' images are read 60 times a second;
- whole: everything, with the hand following the train; nothing is logged or recorded.

The first turns do not count: caches are cold and the hand has not found the train.
"""

import argparse
import time

import numpy as np
from common import print_table, save_json
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ImageRgba8U
from speed_tables import loops_table, stages_table

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.train.track_placement import place_track
from drake_tracker.tasks.train.world import make_train_world
from drake_tracker.world.cameras import CAMERA_NAMES

TURN = 1.0
"""Simulated time [s] of one turn."""
WARM_UP = 4
"""Turns that do not count."""
SEED = 200
WANTED = 0.65
"""Smallest ratio of the whole loop's real-time factor to the bare loop's."""


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
    track, start = place_track(scenario)
    windows = {name: camera.window for name, camera in whole.world.cameras.items()}
    state = whole.GetOutputPort("arm_state").Eval(whole.CreateDefaultContext())
    model = make_arm_model(PUMA560)
    builder = DiagramBuilder()
    world = builder.AddSystem(
        make_train_world(
            scenario,
            description=PUMA560,
            q_initial=state[: model.num_joints],
            track=track,
            start=start,
            windows=windows,
        )
    )
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


def measure(segments):
    """Returns {loop: wall seconds of each counted turn}."""
    scenario = load_scenario("train", seed=SEED).with_settings({"grasp.settle_time": 1e6})  # no grasp
    whole = make_diagram(scenario)
    loops = {
        "physics": bare_loop(scenario, whole, with_images=False),
        "bare": bare_loop(scenario, whole, with_images=True),
        "whole": whole,
    }
    simulators = {name: Simulator(diagram) for name, diagram in loops.items()}
    walls = {name: [] for name in loops}
    for turn in range(WARM_UP + segments):
        for name, simulator in simulators.items():
            start = time.perf_counter()
            simulator.AdvanceTo((turn + 1) * TURN)
            if turn >= WARM_UP:
                walls[name].append(time.perf_counter() - start)
    return walls


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=20, help="counted turns of each loop")
    parser.add_argument("--quick", action="store_true", help="5 turns")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    walls = {name: np.array(wall) for name, wall in measure(5 if options.quick else options.segments).items()}
    cost = {name: wall.mean() / TURN for name, wall in walls.items()}
    stages = {
        "physics, rail and judge": cost["physics"],
        "cameras": cost["bare"] - cost["physics"],
        "vision, host, link and arm": cost["whole"] - cost["bare"],
    }
    results = {
        "real_time_factor": {name: 1 / value for name, value in cost.items()},
        "slowest_and_fastest": {name: [TURN / wall.max(), TURN / wall.min()] for name, wall in walls.items()},
        "seconds_per_simulated_second": stages,
        "ratio": cost["bare"] / cost["whole"],
    }
    print_table(*loops_table(results))
    print_table(*stages_table(results))
    print(f"whole loop against bare loop: {results['ratio']:.2f} (wanted: at least {WANTED})")
    save_json(results, options.json, [SEED])


if __name__ == "__main__":
    main()
