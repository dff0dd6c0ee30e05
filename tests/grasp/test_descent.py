import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import logit

from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, ServoTarget, pack_prediction
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.descent import (
    BESIDE,
    CALIBRATION,
    CATCHING_UP,
    OBLIQUE,
    PRIOR_SURPRISES,
    RESPONSE,
    TRUST,
    Likelihood,
    Offset,
    calibrated,
    horizon,
    likelihood,
    miss,
    no_surprise,
    success_probability,
    time_to_touch,
)
from drake_tracker.grasp.gate import FEWEST_JUDGED, Gate, judge_probability
from drake_tracker.grasp.prediction_memory import ALONG, LATERAL, STAMP, STD, TURN, PredictionMemory, X

CONFIG = GraspConfig(descent="blind", gate="auto")
HORIZON, STAMP_NOW, SPEED = 0.5, 3.0, 0.15
REACH = CONFIG.reach
ROOM = 0.5 * (CONFIG.jaw_opening - CONFIG.object_width)


def packet(std=0.002, speed=SPEED):
    """A `Prediction` vector of a straight path."""
    times = STAMP_NOW + KNOT_SPACING * np.arange(KNOT_COUNT)
    path = [[0.5 + speed * (time - STAMP_NOW), 0.0, 0.48, 0.0, std] for time in times]
    return pack_prediction(STAMP_NOW, 1, np.array(path))


def judged(lateral=0.0, along=0.0, turn=0.0, count=20, stated=0.002, duration=1.0):
    """Records of predictions with these root mean square errors [m, m, rad], whose stated standard deviation [m] is
    ``stated``."""
    rows = np.zeros((count, 12))
    rows[:, STAMP] = STAMP_NOW - 1.0 + np.linspace(0.0, duration, count)
    sign = np.resize([-1.0, 1.0], count)
    for column, error in ((LATERAL, lateral), (ALONG, along), (TURN, turn), (STD, stated * sign)):
        rows[:, column] = error * sign
    return rows


def probability(std=0.002, speed=SPEED, offset=Offset(), **errors):
    return success_probability(CONFIG, packet(std, speed), HORIZON, STAMP_NOW, judged(stated=std, **errors), offset)


def test_the_probability_is_that_of_random_errors():
    """Errors are normal, with a variance that is known as well as that of TRUST and three errors: one now, and two in
    1 s of predictions for 0.5 s."""
    std, lateral, along, turn, offset = 0.010, 0.016, 0.024, 0.4, Offset(0.004, -0.010, 0.1)
    random, freedom = np.random.default_rng(1), TRUST + 3.0
    success = np.ones(400_000, bool)
    stated = std, std, 2.0 * std / (SPEED * HORIZON)
    for limit, was, error, centre in zip((ROOM, REACH, OBLIQUE), stated, (lateral, along, turn), offset):
        sum_of_squares = TRUST * was**2 + 3.0 * error**2
        variance = sum_of_squares / random.chisquare(freedom, len(success))
        success &= np.abs(centre + np.sqrt(variance) * random.standard_normal(len(success))) <= limit
    found = probability(std, lateral=lateral, along=along, turn=turn, offset=offset)
    assert found == pytest.approx(success.mean(), abs=0.004)
    assert 0.5 < found < 0.9


def test_a_good_prediction_is_almost_certain_and_a_bad_one_is_not():
    assert probability() > 0.99
    assert probability(std=0.02) < 0.8
    for worse in ({"lateral": 0.03}, {"along": 0.1}, {"turn": 1.0}):
        assert probability(std=0.008, **worse) < probability(std=0.008, **dict.fromkeys(worse, 0.01)) - 0.1, worse


def test_what_the_estimator_states_counts_until_predictions_have_been_judged():
    def probability(**which):
        return success_probability(CONFIG, packet(0.008), HORIZON, STAMP_NOW, judged(stated=0.008, **which))

    errors = {"lateral": 0.004, "along": 0.004, "turn": 0.1}
    none, little, much = probability(count=0), probability(**errors, duration=0.0), probability(**errors, duration=9.0)
    assert 0.75 < none < little < much, "good predictions make a good one more likely"
    wrong = {name: 8.0 * error for name, error in errors.items()}
    assert none > probability(**wrong, duration=0.0) > probability(**wrong, duration=9.0), "and bad ones a bad one"


def test_an_object_that_stands_keeps_its_direction():
    assert probability(std=0.003, speed=0.0) > 0.99


def target(**values):
    result = ServoTarget([STAMP_NOW + 0.27, 0.5405, 0.0, 0.48, 0.0, SPEED, 0, 0, 0, STAMP_NOW, 1, 0.002, 0.0, 1.0])
    for name, value in values.items():
        setattr(result, name, value)
    return result


def test_the_likelihood_is_that_of_recent_predictions():
    memory, config = PredictionMemory((), judged(lateral=0.012, stated=0.01)), GraspConfig(descent="guided")

    def likely(memory, target):
        return likelihood(config, memory, packet(0.01), target, time_to_touch(config), config.hover_height)

    ahead = horizon(config, target())
    expected = success_probability(config, packet(0.01), ahead, STAMP_NOW, memory.records)
    assert likely(memory, target()) == pytest.approx((expected, expected))
    old = PredictionMemory((), memory.records - np.eye(12)[STAMP] * 5.0)
    nothing = success_probability(config, packet(0.01), ahead, STAMP_NOW, memory.records[:0])
    assert likely(old, target()).now == pytest.approx(nothing) != pytest.approx(expected), "they are too old"
    assert likely(memory, ServoTarget(np.zeros(14))) == (0.0, 0.0), "there is no target"


def walk(*surprises, error=LATERAL, size=0.03, travelled=1.0):
    """Records of 10 s in which an object travelled [m] at constant speed. Predictions made in the 0.2 s before each of
    the times [s] were wrong."""
    rows = judged(count=501, duration=10.0)
    rows[:, X] = np.linspace(0.0, travelled, len(rows))
    for time in surprises:
        ages = time - (rows[:, STAMP] - rows[0, STAMP])
        rows[(ages >= 0.0) & (ages < 0.2), error] = size
    return rows


def survival(count, travelled, distance):
    """Probability of no event on a distance [m], given the events so far: by quadrature over their unknown rate."""
    seen = count + PRIOR_SURPRISES

    def density(u, distance):  # u = rate ** PRIOR_SURPRISES flattens the pole of the prior at 0
        return u ** (count / PRIOR_SURPRISES) * np.exp(-(travelled + distance) * u ** (1.0 / PRIOR_SURPRISES))

    most = (60.0 * (seen + 1.0) / travelled) ** PRIOR_SURPRISES
    ahead, weight = (quad(density, 0.0, most, args=(each,), limit=500)[0] for each in (distance, 0.0))
    return ahead / weight


def test_an_object_that_has_surprised_will_do_so_again():
    """No surprise of a Poisson process whose rate has a Gamma distribution: the integral of its density times exp."""
    for surprises in ((), (2.0,), (2.0, 4.0, 7.0)):
        found = no_surprise(CONFIG, walk(*surprises), HORIZON, 0.05)
        assert found == pytest.approx(survival(len(surprises), 1.0, 0.05), rel=1e-4), surprises
    once = no_surprise(CONFIG, walk(2.0), HORIZON, 0.05)
    assert no_surprise(CONFIG, walk(2.0, 2.3), HORIZON, 0.05) == once, "they have the same cause"
    short = no_surprise(CONFIG, walk(2.0, travelled=0.1), HORIZON, 0.05)
    assert short == pytest.approx(survival(1, 0.1, 0.05), rel=1e-4)
    assert no_surprise(CONFIG, walk(2.0), HORIZON, 0.0) == 1.0, "an object that stands does not"
    assert no_surprise(CONFIG, np.zeros((0, 12)), HORIZON, 0.05) == 1.0, "nothing is known"


def test_a_surprise_is_an_error_by_which_a_grasp_would_miss():
    for error, size, surprise in (
        (LATERAL, 0.9 * ROOM, False),
        (LATERAL, -1.1 * ROOM, True),
        (TURN, 0.9 * OBLIQUE, False),
        (TURN, -1.1 * OBLIQUE, True),
        (ALONG, 2.0 * REACH, False),
    ):
        rows = walk(5.0, error=error, size=size)
        assert (no_surprise(CONFIG, rows, HORIZON, 0.05) < no_surprise(CONFIG, walk(), HORIZON, 0.05)) == surprise


def test_surprises_count_for_a_guided_descent_only():
    for descent in ("blind", "guided"):
        config = GraspConfig(descent=descent)
        # The surprise is older than the predictions that are judged now.
        rows = walk(1.0)
        rows[:, STAMP] += STAMP_NOW - 0.5 - rows[-1, STAMP]
        memory, ahead = PredictionMemory((), rows), horizon(config, target())
        later = PredictionMemory((), rows[rows[:, STAMP] > rows[0, STAMP] + 2.0])
        found, calm = (
            likelihood(config, each, packet(), target(), time_to_touch(config), config.hover_height)
            for each in (memory, later)
        )
        assert found.now == calm.now, "only caution knows of them"
        factors = [no_surprise(config, each.records, ahead, SPEED * ahead) for each in (memory, later)]
        factor = factors[0] / factors[1] if descent == "guided" else 1.0
        assert found.cautious == pytest.approx(factor * calm.cautious)
        assert (factor < 0.97) == (descent == "guided")


def test_the_gate_needs_judged_predictions_and_a_likely_success():
    config = GraspConfig(descent="guided", gate="probability")
    for count, likely, verdict in (
        (FEWEST_JUDGED - 1, Likelihood(1.0, 1.0), Gate.NO_MEMORY),
        (FEWEST_JUDGED, Likelihood(0.899, 0.899), Gate.SUCCESS_UNLIKELY),
        (FEWEST_JUDGED, Likelihood(0.901, 0.899), Gate.SURPRISES),
        (FEWEST_JUDGED, Likelihood(0.901, 0.901), Gate.OPEN),
    ):
        assert judge_probability(config, PredictionMemory((), judged(count=count)), target(), likely) == verdict


@pytest.mark.parametrize("descent", CALIBRATION)
def test_the_calibrated_probability_rises_with_the_computed_one_by_its_three_constants(descent):
    computed = np.linspace(0.02, 0.98, 40)
    found = np.array([calibrated(each, descent) for each in computed])
    a, b, c = CALIBRATION[descent]
    assert logit(found) == pytest.approx(a + b * np.log(computed) - c * np.log(1.0 - computed))
    assert (np.diff(found) > 0.0).all()
    assert [calibrated(end, descent) for end in (0.0, 1.0)] == [0.0, 1.0]


def test_a_guided_descent_relies_on_later_measurements():
    blind, guided = (horizon(GraspConfig(descent=descent), target()) for descent in ("blind", "guided"))
    assert guided == pytest.approx(0.27 + RESPONSE)
    assert blind - guided == pytest.approx(time_to_touch(CONFIG) - RESPONSE)


def test_a_hand_that_is_elsewhere_has_time_to_catch_up_until_its_fingers_are_beside_the_object():
    elsewhere = target(x=0.5405 - 0.03, y=0.01, yaw=2.0 * np.pi - 0.2)
    now, soon = miss(packet(), elsewhere, 0.0, False), miss(packet(), elsewhere, RESPONSE, False)
    assert now == pytest.approx((0.01, -0.03, -0.2))
    assert soon == pytest.approx(np.array(now) / np.e)
    assert miss(packet(), elsewhere, RESPONSE, True) == pytest.approx((0.01, -0.03 / np.e, -0.2 / np.e))
    far = target(x=0.5405 - 0.2)
    assert miss(packet(), far, 0.2, False).along == pytest.approx(-0.2 + 0.2 * CATCHING_UP)
    high, low = (
        likelihood(CONFIG, PredictionMemory(), packet(), target(y=0.03), 0.2, height).now
        for height in (BESIDE + 0.01, BESIDE - 0.01)
    )
    assert high > 0.95 and low < 0.05


def test_an_object_that_does_not_turn_may_be_missed_along_the_jaws_but_not_in_direction():
    cube = GraspConfig(object_width=0.030, reach=0.015, turns=False)

    def chance(across, along):
        at_rest_in_direction = judged(lateral=0.001, along=0.001)
        offset = Offset(across, along)
        return success_probability(cube, packet(), HORIZON, STAMP_NOW, at_rest_in_direction, offset)

    assert chance(0.0, 0.0) > 0.99
    assert chance(0.0, 0.015) == pytest.approx(0.5, abs=0.01)  # half of the cube's edge
    assert chance(0.015, 0.0) > 0.99
    assert chance(0.029, 0.0) == pytest.approx(0.5, abs=0.01)  # half of the room between jaws and cube
    corner = judged()
    corner[10, ALONG] = 0.02
    corner[:, X] = np.linspace(0.0, 0.2, len(corner))
    assert no_surprise(cube, corner, HORIZON, 0.05) == pytest.approx(survival(1, 0.2, 0.05), rel=1e-4)
    assert no_surprise(CONFIG, corner, HORIZON, 0.05) == pytest.approx(survival(0, 0.2, 0.05), rel=1e-4)
