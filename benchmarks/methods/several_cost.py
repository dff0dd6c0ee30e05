"""Times of the vision that tracks several objects beside that of a single one, in turns on the same images."""

import statistics
import time

from methods.several_worlds import TRACKERS, WatchingDiagram
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_tracker import load_scenario, make_diagram
from drake_tracker.core.messages import JawState, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.vision import object_vision

SECONDS, QUICK_SECONDS = 8.0, 2.0
WARM_UP = 60
"""Cycles that do not count."""
TURN, TURNS, QUICK_TURNS = 1.0, 10, 2
"""Duration [s] and number of turns of the whole loops; the first one does not count."""


def cost_of_vision(name, cell, seed, quick):
    """Returns the median time of the vision in a cycle [ms] of a scenario, for each tracker, and the ratio.

    Args:
        name: the scenario.
        cell: name of the result.
        seed: of the scenario.
        quick: whether to take a few images only.
    """
    scenario = load_scenario(name, seed=seed, overrides=["cameras.render_processes=0"])
    images, arm_state = _images(scenario, QUICK_SECONDS if quick else SECONDS)
    turns = {}
    for name, settings in TRACKERS.items():
        own = scenario.with_settings({"vision.method": settings})
        vision = object_vision(resolve(own), resolve(scenario).windows)
        simulator = Simulator(vision)
        context = simulator.get_mutable_context()
        for port, value in (("arm_state", arm_state), ("jaws", [0.0] * message_size(JawState))):
            if vision.HasInputPort(port):
                vision.GetInputPort(port).FixValue(context, value)
        turns[name] = (vision, simulator, context, [])
    for k, pair in enumerate(images):
        for vision, simulator, context, times in turns.values():
            for side, image in pair.items():
                vision.GetInputPort(side).FixValue(context, image)
            start = time.perf_counter()
            simulator.AdvanceTo((k + 0.9) * VISION_PERIOD)
            if k >= WARM_UP:
                times.append(1e3 * (time.perf_counter() - start))
    medians = {name: statistics.median(times) for name, (*_, times) in turns.items()}
    return {"cell": cell, "unit": "ms", **medians, "ratio": medians["several"] / medians["single"]}


def cost_of_loop(seed, quick):
    """Returns the real-time factor of the whole loop, whose hand never grasps, for each tracker, and the ratio."""
    settings = {"grasp.settle_time": 1e6, "cameras.render_processes": "0"}
    loops = {}
    for name, tracker in TRACKERS.items():
        scenario = load_scenario("train:guided", seed=seed).with_settings({**settings, "vision.method": tracker})
        loops[name] = (Simulator(make_diagram(scenario)), [])
    for turn in range(1 + (QUICK_TURNS if quick else TURNS)):
        for simulator, walls in loops.values():
            start = time.perf_counter()
            simulator.AdvanceTo((turn + 1) * TURN)
            if turn > 0:
                walls.append(time.perf_counter() - start)
    factors = {name: TURN / statistics.median(walls) for name, (_, walls) in loops.items()}
    return {
        "cell": "speed of the whole loop",
        "unit": "times real time",
        **factors,
        "ratio": factors["several"] / factors["single"],
    }


def _images(scenario, seconds):
    """Returns pairs of images {input of the vision: `Value` of an image}, and the state of the arm."""
    diagram = WatchingDiagram(scenario, {})
    simulator = Simulator(diagram)
    world = diagram.GetSubsystemByName("world")
    context = world.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    pairs = []
    for k in range(round(seconds / VISION_PERIOD)):
        simulator.AdvanceTo(k * VISION_PERIOD)
        names = ("camera_left", "camera_right")
        pairs.append({name: Value(world.GetOutputPort(name).Eval(context)) for name in names})
    return pairs, world.GetOutputPort("arm_state").Eval(context).copy()
