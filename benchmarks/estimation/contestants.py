"""The contestants: the estimators of this project and, on request, the baselines, with frozen parameters."""

import json
from pathlib import Path

from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.parts import TurnFilter

PARAMETERS = Path(__file__).with_name("parameters.json")
"""Written by `tune.py` before any published run."""
OURS = ("arc_length", "arc_length_literal", "alpha_beta_gamma", "coordinated_turn", "closed_path")
MODELS = ("velocity", "acceleration", "turn")
SHARP_BASELINES = ("stonesoup_turn", "filterpy_turn", "filterpy_turn_fixed")
"""Of the other libraries, those that are run on the paths with sharp bends."""
SINGLE = "coordinated_turn_single"
"""One filter of coordinated_turn, for gentle bends; likewise. It is what closed_path runs until the path closes."""
FIXED_TURN = {"noise": 0.03**2, "turn_noise": 0.5**2}
"""Of `filterpy_turn_fixed`: one setting for every path, chosen by hand for sharp bends before any run that is kept."""
BASELINES = tuple(f"{library}_{model}" for library in ("stonesoup", "filterpy") for model in MODELS)


def read_parameters():
    return json.loads(PARAMETERS.read_text(encoding="utf-8"))


def contestant(name, sigma_mm, law, parameters, path="oval"):
    """Returns an estimator of `OURS` or a baseline for points with noise ``sigma_mm`` [mm], a speed law and a path.

    ``parameters`` is what `read_parameters` returns. Alpha-beta-gamma and arc length have one set of parameters for
    each noise. The baselines have one for each speed law on the oval, the turn's also for each on the paths with sharp
    bends, and are given the noise; only `filterpy_turn_fixed` has the same everywhere. Coordinated turn and closed path
    always have their defaults, but no allowance for a systematic error, which these points do not have.
    """
    if name == "arc_length_literal":
        return make_estimator("arc_length", mode="literal")
    if name in ("arc_length", "alpha_beta_gamma"):
        return make_estimator(name, **parameters[name][f"{sigma_mm:g}"])
    if name == SINGLE:
        return TurnFilter()
    if name == "closed_path":
        return make_estimator(name, systematic_std=0.0)
    if name in OURS:
        return make_estimator(name)
    from baselines import Filterpy, StoneSoup  # slow to import, and only some runs need it

    library, model, *fixed = name.split("_")
    settings = FIXED_TURN if fixed else parameters[model].get(f"{path} {law}") or parameters[model][law]
    return {"stonesoup": StoneSoup, "filterpy": Filterpy}[library](model, 1e-3 * sigma_mm, **settings)
