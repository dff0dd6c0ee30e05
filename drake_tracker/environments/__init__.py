"""Gymnasium environments with exact latency, policies, and data sets of their episodes.

A policy observes measurements and returns actions; the arm follows them within its limits. Importing this package
registers ``drake_tracker/Train-v0``, ``Ball-v0`` and ``Conveyor-v0``. It needs the extra ``gym``; no other part of the
package imports it. Begin with `TrackerEnvironment`.

    scenario's diagram ──▶ Measurements ──▶ policy ──▶ ActionLine (latency) ──▶ action in place of the grasp machine
"""

import lazy_loader
from gymnasium import register

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_CLASS = "drake_tracker.environments.environment:TrackerEnvironment"
_REGISTERED = [
    register(f"drake_tracker/{task.title()}-v0", entry_point=_CLASS, kwargs={"scenario": task})
    for task in ("train", "ball", "conveyor")
]
