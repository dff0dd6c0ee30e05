import math

import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.config import CoordinatedTurn

NOT_NUMBERS = ("fast", None, [1.0], math.nan, math.inf, -1.0, True)
PARAMETERS = {
    "arc_length": ("period", "start_sigma", "systematic_std", "min_speed", "restart_after", "order"),
    "alpha_beta_gamma": ("tracking_index", "period", "systematic_std", "restart_after"),
    "coordinated_turn": ("systematic_std", "restart_after"),
    "closed_path": ("systematic_std",),
}


@pytest.mark.parametrize("kind, name", [(kind, name) for kind, names in PARAMETERS.items() for name in names])
def test_a_value_that_is_not_a_number_is_named_at_construction(kind, name):
    for value in NOT_NUMBERS:
        with pytest.raises(DrakeTrackerError, match=f"{name} is") as caught:
            make_estimator(kind, **{name: value})
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "kind, parameters, said",
    [
        ("arc_length", {"speed_noise": 1.0}, "arc_length has no parameter 'speed_noise'; it has mode, attenuation"),
        ("arc_length", {"baseline": 601}, r"baseline is 601; it must be a whole number in 0\.\.600"),
        ("closed_path", {"turn": {"bend_noise": 1.0}}, "coordinated_turn: settings are {.*}; they must be a Coord"),
        ("closed_path", {"turn": CoordinatedTurn(bend_noise=0.0)}, "bend_noise is 0.0"),
        ("closed_path", {"phase": 3}, "phase_filter: settings are 3; they must be a PhaseFilterConfig"),
        ("alpha_beta_gamma", {"tracking_index": 1e-300}, "tracking_index is 1e-300; it must be 1e-30 or more"),
        ("inclined_plane", {}, "inclined_plane: .*X_WB"),
        ([], {}, "kind is"),
    ],
)
def test_an_unusable_parameter_is_reported_in_one_line(kind, parameters, said):
    with pytest.raises(DrakeTrackerError, match=said) as caught:
        make_estimator(kind, **parameters)
    assert "\n" not in str(caught.value)


def test_a_constructor_accepts_wider_ranges_than_a_scenario_file():
    make_estimator("arc_length", baseline=90)
    for kind in ("alpha_beta_gamma", "coordinated_turn"):
        make_estimator(kind, ready_after=0.0)
