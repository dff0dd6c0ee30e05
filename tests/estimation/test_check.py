"""What an estimator of one's own must do, and what is said of one that does not."""

import own_estimator
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation import ESTIMATORS, make_estimator
from drake_tracker.estimation.check import check_estimator


@pytest.mark.parametrize("kind", sorted(set(ESTIMATORS) - {"slope"}))
def test_the_packages_own_pass(kind):
    check_estimator(make_estimator(kind))


def test_one_of_the_users_own_passes():
    check_estimator(own_estimator.StraightOn())


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (own_estimator.WithoutStd, " has no method predict_std"),
        (own_estimator.ChangesItsState, ".update changed the state that it was given"),
        (own_estimator.ReturnsItsState, ".update returned the very state that it was given"),
        (own_estimator.ForgetsTheTime, ".update returned a state whose stamp is 0.0, not the point's, 0.0167"),
        (own_estimator.CoastsWithoutPoints, ".update must return the state that it was given when the point is None"),
        (own_estimator.WithoutYaw, ".predict returned the shape (31, 3) for 31 times, not (31, 4) (rows x, y, z, yaw)"),
        (own_estimator.OneDeviation, ".predict_std returned the shape () for 31 times, not (31,)"),
        (own_estimator.NotFinite, ".predict returned a number that is not finite"),
        (own_estimator.Raises, " raised AttributeError: 'Newest' object has no attribute 'nothing' (own_estimator.py"),
        (own_estimator.without_stamp, ".initial_state returned a NoneType without stamp"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(make, said):
    with pytest.raises(DrakeTrackerError) as caught:
        check_estimator(make(), "mine")
    assert str(caught.value).startswith(f"mine{said}")
    assert "\n" not in str(caught.value)
