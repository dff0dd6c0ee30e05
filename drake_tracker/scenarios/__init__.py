"""What a run is about, as data: the settings, the named scenarios, and the loader that reads and checks them.

    train.yaml ──tree──▶ values with their origins ──reader──▶ checked scenario ──▶ diagrams/, simulate
"""

from drake_tracker.scenarios.ball_scenario import BallScenario
from drake_tracker.scenarios.loader import (
    in_package,
    list_scenarios,
    load_scenario,
    save_scenario,
    scenario_file,
    validate,
)
from drake_tracker.scenarios.train_scenario import TrainScenario

__all__ = [
    "BallScenario",
    "TrainScenario",
    "in_package",
    "list_scenarios",
    "load_scenario",
    "save_scenario",
    "scenario_file",
    "validate",
]
