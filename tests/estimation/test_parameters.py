import math

import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import make_estimator

NO_NUMBERS = ("fast", None, [1.0], math.nan, math.inf, -1.0, True)
PARAMETERS = {
    "arc_length": ("period", "start_sigma", "systematic_std", "min_speed", "restart_after", "baseline_factor", "order"),
    "alpha_beta_gamma": ("tracking_index", "vertical_tracking_index", "period", "systematic_std", "restart_after"),
    "coordinated_turn": ("speed_noise", "start_sigma", "systematic_std", "restart_after", "ready_after"),
    "closed_path": ("systematic_std",),
}


@pytest.mark.parametrize("kind, name", [(kind, name) for kind, names in PARAMETERS.items() for name in names])
def test_what_is_no_number_is_named_when_the_estimator_is_made(kind, name):
    for value in NO_NUMBERS:
        with pytest.raises(DrakeTrackerError, match=f"{name} is") as caught:
            make_estimator(kind, **{name: value})
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "kind, parameters, said",
    [
        ("arc_length", {"speed_noise": 1.0}, "arc_length has no parameter 'speed_noise'; it has mode, period"),
        ("closed_path", {"turn": {"colour": 1}}, "closed_path's turn has no parameter 'colour'; it has speed_noise"),
        ("closed_path", {"phase": {"fading": 0.0}}, "fading is 0.0"),
        ("closed_path", {"phase": 3}, "closed_path's phase: parameters are 3; they must be a dict of cruise_noise"),
        ("alpha_beta_gamma", {"tracking_index": 1e-300}, "tracking_index is 1e-300; it must be 1e-30 or more"),
        ("slope", {}, "slope: .*X_WB"),
        ([], {}, "kind is"),
    ],
)
def test_what_cannot_be_used_is_one_line(kind, parameters, said):
    with pytest.raises(DrakeTrackerError, match=said) as caught:
        make_estimator(kind, **parameters)
    assert "\n" not in str(caught.value)
