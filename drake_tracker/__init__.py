"""Tracking and grasping of moving objects by a hand-eye system, as Drake Systems.

    world --images--> vision --points--> estimation --predictions--> link --> arm (grasp) --joint commands--> world

Each arrow is a port; each subsystem is a folder of the package and a System of the diagram. Ground truth stays in the
world. In five lines::

    from drake_tracker import load_scenario, make_diagram, simulate
    scenario = load_scenario("train", seed=7, overrides=["track.speed=0.2"])
    diagram = make_diagram(scenario)  # a Drake Diagram, to inspect or to connect to your own
    summary = simulate(scenario)      # or run it; returns a dict with the outcome
    print(summary["success"], summary["time_to_grasp_s"])

The names below are imported when they are first used: importing the package loads neither Drake nor OpenCV.
"""

import lazy_loader

__version__ = "0.3.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
