"""Tracking and grasping of moving objects by a hand-eye system, as Drake Systems.

    world --images--> vision --points--> estimation --predictions--> link --> arm (grasp) --joint commands--> world

Each arrow is a port, each room a folder and a System of the diagram; truth stays in the world. In five lines::

    from drake_tracker import load_scenario, make_diagram, simulate
    scenario = load_scenario("train", seed=7, overrides=["track.speed=0.2"])
    diagram = make_diagram(scenario)      # a Drake Diagram, to look at or to wire into your own
    summary = simulate(scenario)          # or run it: a dict with the outcome
    print(summary["success"], summary["time_to_grasp_s"])
"""

import importlib

__version__ = "0.2.0"

_PUBLIC = {
    "DrakeTrackerError": "drake_tracker.core.errors",
    "load_scenario": "drake_tracker.tasks",
    "list_scenarios": "drake_tracker.tasks",
    "make_diagram": "drake_tracker.tasks.registry",
    "make_estimator": "drake_tracker.estimation",
    "run_campaign": "drake_tracker.campaign.run",
    "simulate": "drake_tracker.run.simulation",
}
__all__ = sorted(_PUBLIC)


def __getattr__(name):
    """Loads a public name at its first use: Drake takes a second to import, and `--help` should not wait for it."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'drake_tracker' has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)
