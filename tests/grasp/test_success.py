import numpy as np
import pytest

from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, ServoTarget, pack_prediction
from drake_tracker.grasp.config import GraspConfig, touch_delay
from drake_tracker.grasp.gate import horizon, likelihood
from drake_tracker.grasp.prediction_memory import ALONG, LATERAL, STAMP, TURN, PredictionMemory
from drake_tracker.grasp.success import FEWEST_RECORDS, OBLIQUE, REACH, RESPONSE, success_probability

CONFIG = GraspConfig()
HORIZON, STAMP_NOW, SPEED = 0.5, 3.0, 0.15


def packet(std=0.002, speed=SPEED):
    """A `Prediction` vector of a straight path."""
    times = STAMP_NOW + KNOT_SPACING * np.arange(KNOT_COUNT)
    path = [[0.5 + speed * (time - STAMP_NOW), 0.0, 0.48, 0.0, std] for time in times]
    return pack_prediction(STAMP_NOW, 1, np.array(path))


def judged(lateral=0.0, along=0.0, turn=0.0, count=20, seed=0):
    """Records of predictions whose errors are normal, with these standard deviations [m, m, rad]."""
    rows, random = np.zeros((count, 10)), np.random.default_rng(seed)
    rows[:, STAMP] = STAMP_NOW - 1.0 + 0.03 * np.arange(count)
    for column, std in ((LATERAL, lateral), (ALONG, along), (TURN, turn)):
        rows[:, column] = std * random.choice([-1.0, 1.0], count)
    return rows


def probability(std=0.002, speed=SPEED, **errors):
    return success_probability(CONFIG, packet(std, speed), HORIZON, STAMP_NOW, judged(**errors))


def test_the_probability_is_that_of_random_errors():
    std, lateral, along, turn = 0.008, 0.012, 0.030, 0.2
    random = np.random.default_rng(1)
    across = random.normal(0.0, np.hypot(std, lateral), 100_000)
    ahead = random.normal(0.0, np.hypot(std, along), 100_000)
    oblique = random.normal(0.0, np.hypot(2.0 * std / (SPEED * HORIZON), turn), 100_000)
    room = 0.5 * (CONFIG.jaw_opening - CONFIG.object_width)
    held = (abs(across) <= room) & (abs(ahead) <= REACH) & (abs(oblique) <= OBLIQUE)
    assert probability(std, lateral=lateral, along=along, turn=turn) == pytest.approx(held.mean(), abs=0.006)


def test_a_good_prediction_is_almost_certain_and_a_bad_one_is_not():
    assert probability() > 0.99
    for worse in ({"std": 0.02}, {"lateral": 0.03}, {"along": 0.1}, {"turn": 0.6}):
        assert probability(**worse) < 0.8, worse


def test_without_judged_predictions_nothing_is_likely():
    assert probability(count=FEWEST_RECORDS - 1) == 0.0 < probability(count=FEWEST_RECORDS)


def test_an_object_that_stands_keeps_its_direction():
    assert probability(std=0.003, speed=0.0) > 0.99


def test_the_likelihood_is_that_of_recent_predictions():
    target = ServoTarget([STAMP_NOW + 0.27, 0.5, 0.0, 0.48, 0.0, SPEED, 0, 0, 0, STAMP_NOW, 1, 0.002, 0.0, 1.0])
    memory = PredictionMemory((), judged(lateral=0.012))
    config = GraspConfig(descent="guided")
    rows = memory.records
    expected = success_probability(config, packet(), horizon(config, target), STAMP_NOW, rows)
    assert likelihood(config, memory, packet(), target) == expected
    old = PredictionMemory((), rows - np.eye(10)[STAMP] * 5.0)
    assert likelihood(config, old, packet(), target) == 0.0, "they are too old"
    assert likelihood(config, memory, packet(), ServoTarget(np.zeros(14))) == 0.0, "there is no target"


def test_a_guided_descent_relies_on_later_measurements():
    target = ServoTarget([STAMP_NOW + 0.27, 0, 0, 0, 0, 0, 0, 0, 0, STAMP_NOW, 1, 0, 0.0, 1.0])
    blind, guided = (horizon(GraspConfig(descent=descent), target) for descent in ("blind", "guided"))
    assert guided == pytest.approx(0.27 + RESPONSE + touch_delay(CONFIG))
    assert blind - guided == pytest.approx(CONFIG.descent_duration - CONFIG.closing_lead - RESPONSE)
