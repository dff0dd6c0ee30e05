import subprocess
import sys

import numpy as np
import own_estimator
import pytest
from drives import Drive
from slopes import board_pose

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import KNOT_COUNT, KNOT_SPACING
from drake_tracker.estimation import ESTIMATORS, Estimator, EstimatorState, make_estimator
from drake_tracker.estimation.checked_estimator import LARGEST_TURN
from drake_tracker.estimation.config import ClosedPath, CoordinatedTurn, InclinedPlane
from drake_tracker.estimation.estimator import check_estimator
from drake_tracker.world.train.tracks import make_track

CONTEXT = {InclinedPlane: {"X_WB": board_pose()}}


@pytest.mark.parametrize("settings_type", ESTIMATORS.makers, ids=lambda kind: kind.__name__)
def test_every_kind_satisfies_the_protocol_and_has_the_defaults_of_its_settings(settings_type):
    estimator = ESTIMATORS.maker(settings_type)(**CONTEXT.get(settings_type, {}))
    assert isinstance(estimator, Estimator)
    assert isinstance(estimator.initial_state(), EstimatorState)
    assert estimator.settings == settings_type()


def test_a_name_and_an_instance_of_the_settings_make_the_same_estimator():
    by_name = make_estimator("coordinated_turn", bend_noise=4.0)
    by_settings = make_estimator(CoordinatedTurn(bend_noise=4.0), period=1.0 / 30.0)
    assert type(by_name) is type(by_settings) and by_name.settings == by_settings.settings


def test_settings_of_no_estimator_are_refused():
    with pytest.raises(DrakeTrackerError, match="estimator: kind is"):
        make_estimator(object())


def test_the_closed_path_passes_its_systematic_error_to_its_coordinated_turn():
    estimator = make_estimator(ClosedPath(systematic_std=0.007))
    state = estimator.initial_state()
    for k in range(40):
        state = estimator.update(state, k / 60.0, [0.002 * k, 0.0, 0.5])
    assert state.path is None and estimator.predict_std(state, [state.stamp])[0] > 0.007


def test_the_settings_load_neither_drake_nor_scipy():
    code = "import sys, drake_tracker.estimation.estimator; print(sorted({'pydrake', 'scipy'} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.mark.parametrize("kind", sorted(set(ESTIMATORS.names) - {"inclined_plane"}))
def test_the_estimators_of_the_package_pass(kind):
    check_estimator(make_estimator(kind))


@pytest.mark.parametrize("kind", sorted(set(ESTIMATORS.names) - {"inclined_plane"}))
@pytest.mark.parametrize("speed", [0.10, 0.20, 0.40])
def test_the_predicted_direction_is_continuous_on_a_figure_eight(kind, speed):
    """The arm rejects a direction that jumps; the filters of coordinated_turn turned more than half a turn apart."""
    estimator, drive = make_estimator(kind), Drive(make_track("figure_eight"), speed, 8.0)
    state = estimator.initial_state()
    for t, p in zip(drive.times, drive.points, strict=True):
        state = estimator.update(state, t, p)
        if estimator.ready(state):
            yaw = estimator.predict(state, t + KNOT_SPACING * np.arange(KNOT_COUNT))[:, 3]
            assert np.abs(np.diff(yaw)).max() < LARGEST_TURN


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
        (
            own_estimator.Raises,
            ".ready raised AttributeError: 'Newest' object has no attribute 'nothing' (own_estimator.py",
        ),
        (own_estimator.ReturnsNone, ".predict returned the shape () for 31 times, not (31, 4)"),
        (own_estimator.Exits, ".update raised SystemExit: 0 (own_estimator.py line"),
        (own_estimator.NegativeDeviation, ".predict_std returned -0.01; it must return 0 to 1000 m"),
        (own_estimator.WrappedYaw, ".predict returned a yaw that changes by 6."),
        (own_estimator.YawInDegrees, ".predict returned a yaw that is "),
        (own_estimator.Remembers, " gave other predictions for the same points when it was given a second object"),
        (own_estimator.DrawsNumbers, " gave other predictions for the same points when it was given a second object"),
        (own_estimator.without_stamp, ".initial_state returned a NoneType without stamp"),
    ],
)
def test_an_error_is_reported_in_one_line(make, said):
    with pytest.raises(DrakeTrackerError) as caught:
        check_estimator(make(), "mine")
    assert str(caught.value).startswith(f"mine{said}")
    assert "\n" not in str(caught.value)
