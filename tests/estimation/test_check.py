"""What a custom estimator must do, and the message about one that does not."""

import own_estimator
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import ESTIMATORS, make_estimator
from drake_tracker.estimation.check import check_estimator


@pytest.mark.parametrize("kind", sorted(set(ESTIMATORS.names) - {"inclined_plane"}))
def test_the_estimators_of_the_package_pass(kind):
    check_estimator(make_estimator(kind))


def test_a_custom_estimator_passes():
    check_estimator(own_estimator.StraightOn())


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (own_estimator.WithoutStd, " has no method predict_std"),
        (own_estimator.ChangesItsState, ".update changed the state that it was given"),
        (own_estimator.ReturnsItsState, ".update returned the same state for a new point"),
        (own_estimator.ForgetsTheTime, ".update returned a state with stamp 0.0 for a point of 0.0167 s"),
        (own_estimator.CoastsWithoutPoints, ".update must return the same state when the point is None"),
        (own_estimator.WithoutYaw, ".predict returned the shape (31, 3) for 31 times, not (31, 4) (rows x, y, z, yaw)"),
        (own_estimator.OneDeviation, ".predict_std returned the shape () for 31 times, not (31,)"),
        (own_estimator.NotFinite, ".predict returned a number that is not finite"),
        (own_estimator.Raises, " raised AttributeError: 'Newest' object has no attribute 'nothing' (own_estimator.py"),
        (own_estimator.without_stamp, ".initial_state returned a NoneType without stamp"),
    ],
)
def test_an_error_is_reported_in_one_line(make, said):
    with pytest.raises(DrakeTrackerError) as caught:
        check_estimator(make(), "mine")
    assert str(caught.value).startswith(f"mine{said}")
    assert "\n" not in str(caught.value)
