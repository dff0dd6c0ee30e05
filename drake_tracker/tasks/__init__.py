"""The tasks: for each one its scenario, diagram, judgement, summary, pictures and video.

The name of a scenario goes in (`load_scenario`); out come its settings, its diagram
(`make_diagram`, for the ball after `initialise`), and with `task_of` the `Task`, through which the applications run,
judge, draw and replay it. Each task is a subpackage, registered in `drake_tracker.tasks.registry`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
