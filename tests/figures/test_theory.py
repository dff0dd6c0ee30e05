"""Numbers of the figures that need no run: 8, 9, 10, 15 and the Kaiser window."""

import numpy as np
import pytest
from scipy.special import erf

from drake_tracker.estimation.parts.rice import moment_ratio
from drake_tracker.figures.curvature import curvature_limit
from drake_tracker.figures.densities import arc_length_densities, bending_densities, moment_ratios
from drake_tracker.figures.kaiser_response import kaiser_response


def test_densities_of_arc_length_integrate_to_one_and_are_biased_upwards():
    curves = arc_length_densities()["curves"]
    assert [row["sigma"] for row in curves] == pytest.approx([0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
    for row in curves:
        assert row["integral"] == pytest.approx(1.0, abs=1e-4)
    for key in ("peak", "mean"):
        drift = np.array([row[key] for row in curves])
        assert drift[0] > 1.0 and np.all(np.diff(drift) > 0.0)


def test_the_inversion_shown_lies_on_the_curve():
    numbers = moment_ratios()
    assert moment_ratio(numbers["example"]["x_0"]) == pytest.approx(numbers["example"]["p"], abs=1e-6)
    assert numbers["u_1"][0] == pytest.approx(2.0 / np.sqrt(np.pi))


def test_the_papers_density_of_bending_omits_points_behind():
    for row in bending_densities()["curves"]:
        assert row["exact_integral"] == pytest.approx(1.0, abs=1e-4)
        assert row["paper_integral"] == pytest.approx(erf(1.0 / (np.sqrt(2.0) * row["k"])), abs=1e-4)


def test_the_window_has_the_parameters_of_the_paper():
    numbers = kaiser_response()
    assert numbers["order"] == 30 and numbers["delay_s"] == pytest.approx(0.25)
    assert numbers["highest_side_lobe_db"] == pytest.approx(-19.5, abs=0.1)
    assert numbers["highest_side_lobe_rectangular_db"] == pytest.approx(-13.2, abs=0.1)
    assert numbers["highest_side_lobe_windowed_sinc_db"] == pytest.approx(-30.0, abs=1.5)
    for response in numbers["response_db"].values():
        assert response[0] == pytest.approx(0.0, abs=1e-9)


def test_the_error_of_the_curvature_limit_is_quadratic_in_the_interval():
    numbers = curvature_limit()
    error = np.abs(numbers["relative_error"])
    assert error[0] < 1e-3
    slope = np.polyfit(np.log(numbers["interval_s"][:10]), np.log(error[:10]), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.1)
