"""The contestants: the estimators of this project and, on request, the baselines, with frozen parameters."""

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

    ``parameters`` is what `read_parameters` returns. Alpha-beta-gamma and arc length have one set of parameters for
    each noise. The baselines have one for each speed law, and are given the noise. Coordinated turn and closed path
    always have their defaults, but no allowance for a systematic error, which these points do not have.
    """
    if name == "arc_length_literal":
        return make_estimator("arc_length", mode="literal")
    if name in ("arc_length", "alpha_beta_gamma"):
        return make_estimator(name, **parameters[name][f"{sigma_mm:g}"])
    if name == "closed_path":
        return make_estimator(name, systematic_std=0.0)
    if name in OURS:
        return make_estimator(name)
    from baselines import Filterpy, StoneSoup  # slow to import, and only some runs need it

    library, model = name.split("_")
    return {"stonesoup": StoneSoup, "filterpy": Filterpy}[library](model, 1e-3 * sigma_mm, **parameters[model][law])
