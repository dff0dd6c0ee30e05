"""Numbers of the figures that come from a log, computed from logs whose truth is known."""

import numpy as np
import pytest

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.parts.rice import mean_factor
from drake_tracker.figures.grasp_frames import moments, shown_moments
from drake_tracker.figures.horizon import HORIZONS, horizon_errors, make_drive
from drake_tracker.figures.measured_arc import arc_lengths, filter_arc_lengths, filtered_arc, measured_density
from drake_tracker.figures.trajectory import trajectory
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.task import TASK

SPEED, RADIUS, SIGMA = 0.15, 0.2, 0.001


def signal(name, times, **fields):
    names = tuple(TASK.signals()[name][1])
    data = np.zeros((len(times), len(names)))
    for field, row in fields.items():
        data[:, names.index(field)] = row
    return Signal(times, data, names)


@pytest.fixture
def log():
    """A train on a circle, measured with white noise of 1 mm, and a command 5 mm to its left."""
    times = VISION_PERIOD * np.arange(1500)
    angle = SPEED / RADIUS * times
    x, y, yaw = RADIUS * np.cos(angle), RADIUS * np.sin(angle), angle + 0.5 * np.pi
    noise = SIGMA * np.random.default_rng(2).standard_normal((2, len(times)))
    inside = 1.0 - 0.005 / RADIUS
    return {
        "truth_train_state": signal("truth_train_state", times, x=x, y=y, qw=np.cos(yaw / 2), qz=np.sin(yaw / 2)),
        "point": signal("point", times, stamp=times, x=x + noise[0], y=y + noise[1], valid=1.0),
        "target": signal("target", times, time=times, x=inside * x, y=inside * y, valid=1.0),
        "command": signal("command", times, phase=float(Phase.TRACK)),
    }


def test_figure_7_finds_the_arc_length_that_its_mean_misses(log):
    numbers = measured_density(log)
    true, both = SPEED * VISION_PERIOD, np.sqrt(2.0) * SIGMA
    assert numbers["true_s_0_m"] == pytest.approx(true, rel=1e-3)
    assert numbers["s_1_m"] == pytest.approx(both * mean_factor(true / both), rel=0.04)
    assert numbers["s_1_m"] > 1.1 * true
    assert numbers["fit_s_0_m"] == pytest.approx(true, rel=0.1)
    assert numbers["fit_sigma_m"] == pytest.approx(both, rel=0.1)
    assert numbers["kolmogorov_smirnov"] < 0.04
    width = np.diff(numbers["edges_m"])
    assert np.sum(width * numbers["density_1_m"]) == pytest.approx(1.0)
    found = numbers["jitter_correlation"]
    assert found["low"] < found["coefficient"] < found["high"] and abs(found["coefficient"]) < 0.1


def test_chords_across_a_gap_do_not_count():
    stamps = VISION_PERIOD * np.array([0, 1, 2, 7, 8])
    times, s = arc_lengths(stamps, np.column_stack([0.1 * stamps, 0.0 * stamps]))
    assert times == pytest.approx(stamps[[1, 2, 4]])
    assert s == pytest.approx(0.1 * VISION_PERIOD)


def test_the_filter_of_figure_12_is_the_mean_of_noiseless_input_and_holds_without_a_root():
    s_1, s_0, _ = filter_arc_lengths(np.full(40, 0.0025))
    assert np.isnan(s_0[:30]).all()
    assert s_1[30:] == pytest.approx(0.0025) and s_0[30:] == pytest.approx(0.0025)
    jump = np.concatenate([np.full(40, 0.0025), [0.5]])  # one outlier: a ratio that no Rice distribution has
    assert filter_arc_lengths(jump)[1, -1] == pytest.approx(0.0025)


def test_figure_12_removes_most_of_the_bias(log):
    numbers = filtered_arc(log)
    assert numbers["bias_s_1"] > 0.10
    assert abs(numbers["bias_s_0"]) < 0.5 * numbers["bias_s_1"]


def test_figure_13_shows_one_lap_and_the_error_of_the_command(log):
    lap = 2.0 * np.pi * RADIUS
    numbers = trajectory(log, TrainScenario(name="circle"), lap)
    assert numbers["lap_s"] == pytest.approx(lap / SPEED, abs=0.02)
    assert len(numbers["points_m"]) == pytest.approx(lap / SPEED / VISION_PERIOD, abs=2)
    assert numbers["commanded_rms_across_m"] == pytest.approx(0.005, abs=1e-4)
    assert numbers["commanded_rms_along_m"] < 1e-4


def phases(*spans):
    times = 0.03 * np.arange(200)
    phase = np.zeros(len(times))
    for name, start in spans:
        phase[times >= start] = name
    return {"command": signal("command", times, phase=phase)}


def test_the_three_moments_of_a_grasp():
    log = phases((Phase.TRACK, 1.0), (Phase.INTERCEPT, 3.0), (Phase.CLOSE, 3.3), (Phase.LIFT, 3.6), (Phase.HOLD, 4.5))
    scenario = TrainScenario(name="grasp")
    assert [moment.name for moment in shown_moments(log, scenario)] == ["intercept", "grasp", "lift"]
    times = {moment.name: moment.time for moment in moments(log, scenario)}
    assert times["track"] < 3.0 < times["intercept"] < 3.3
    assert times["grasp"] == pytest.approx(3.6, abs=0.04) and times["lift"] == pytest.approx(4.5, abs=0.04)


def test_a_run_without_a_lift_still_has_three_moments():
    shown = shown_moments(phases((Phase.TRACK, 1.0)), TrainScenario(name="none"))
    assert [moment.phase for moment in shown] == ["track"] * 3


class Oracle:
    """An estimator that knows the drive; it is ready after a second."""

    def __init__(self, drive, offset=0.0):
        self.drive, self.offset = drive, offset

    def initial_state(self):
        return 0.0

    def update(self, state, stamp, point):
        return stamp

    def ready(self, state):
        return state >= 1.0

    def predict(self, state, times):
        x, y, yaw = self.drive.pose(times)
        return np.column_stack([x + self.offset, y, 0.0 * x, yaw])


def test_errors_over_the_horizon_are_distances_from_the_truth():
    drive = make_drive(1, laps=0.3)
    times, errors = horizon_errors(Oracle(drive, offset=0.003), drive)
    assert errors.shape == (len(times), len(HORIZONS)) and times[0] >= 1.0
    assert errors == pytest.approx(0.003)
