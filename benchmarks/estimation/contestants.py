"""Who takes part: the estimators of this project and, where asked for, the baselines, with frozen parameters."""

import json
from pathlib import Path

from drake_tracker.estimation import make_estimator

PARAMETERS = Path(__file__).with_name("parameters.json")
"""Written by `tune.py` before any published run."""
OURS = ("arc_length", "arc_length_literal", "alpha_beta_gamma", "coordinated_turn", "closed_path")
MODELS = ("velocity", "acceleration", "turn")
BASELINES = tuple(f"{library}_{model}" for library in ("stonesoup", "filterpy") for model in MODELS)


def read_parameters():
    return json.loads(PARAMETERS.read_text(encoding="utf-8"))


def contestant(name, sigma_mm, law, parameters):
    """Returns an estimator of `OURS` or `BASELINES` for points with noise ``sigma_mm`` [mm] and a speed law.

    ``parameters``: of `read_parameters`. Alpha-beta-gamma and arc length have a set for each noise, the baselines one
    for each speed law, and the noise is told them. Coordinated turn and closed path have their one default setting.
    """
    if name == "arc_length_literal":
        return make_estimator("arc_length", mode="literal")
    if name in ("arc_length", "alpha_beta_gamma"):
        return make_estimator(name, **parameters[name][f"{sigma_mm:g}"])
    if name in OURS:
        return make_estimator(name)
    from baselines import Filterpy, StoneSoup  # slow to import, and only some runs need it

    library, model = name.split("_")
    return {"stonesoup": StoneSoup, "filterpy": Filterpy}[library](model, 1e-3 * sigma_mm, **parameters[model][law])
