"""The tasks, each a folder: what a run of it can be told, its diagram, its judge, its summary and its pictures."""

from drake_tracker.tasks.loader import (
    in_package,
    list_scenarios,
    load_scenario,
    save_scenario,
    scenario_file,
    validate,
)

__all__ = ["in_package", "list_scenarios", "load_scenario", "save_scenario", "scenario_file", "validate"]
