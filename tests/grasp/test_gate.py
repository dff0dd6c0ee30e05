import dataclasses

import numpy as np
import pytest
from variants import variant

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for, make_parameters
from drake_tracker.arm.motion.transform_equation import share_done
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, ServoTarget, pack_prediction
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.descent import horizon
from drake_tracker.grasp.gate import (
    FEWEST_RECORDS,
    ONE_PASS,
    STARTING,
    Gate,
    can_follow,
    is_straight,
    judge_memory,
    judge_prediction,
    stands,
    strays,
    touch_delay,
)
from drake_tracker.grasp.prediction_memory import PredictionMemory, remember

PARAMETERS = GraspConfig(descent="blind", gate="auto")


def straight(t, speed=0.15):
    return np.stack(np.broadcast_arrays(0.56, -0.4 + speed * np.asarray(t), 0.485, np.pi / 2), axis=-1)


def circle(t, speed=0.15, radius=0.12):
    a = speed / radius * np.asarray(t)
    pose = np.broadcast_arrays(0.56 + radius * np.cos(a), radius * np.sin(a), 0.485, a + np.pi / 2)
    return np.stack(pose, axis=-1)


def packet_at(stamp, path=straight):
    times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
    return pack_prediction(stamp, 1, np.column_stack([path(times), np.full(KNOT_COUNT, 0.002)]))


THERE = circle(30.7)
"""Where the object went from the place of most of these tests, circle(30)."""


def record(stamp, pose, lateral=0.0, along=0.0, turn_deg=0.0, there=THERE):
    return [
        stamp,
        pose[0],
        pose[1],
        pose[3],
        lateral,
        along,
        np.deg2rad(turn_deg),
        there[0],
        there[1],
        there[3],
        0.01,
        0.0,
    ]


def memory_of(*rows):
    return PredictionMemory((), np.reshape([np.array(row, dtype=float) for row in rows], (-1, 12)))


def pass_here(now, count=5, at=10.0, **error):
    """An earlier pass, ``at`` seconds ago, of the place where the packet of ``now`` starts."""
    return [record(now - at + 0.03 * k, circle(now), **error) for k in range(count)]


def judge(memory, now, path=circle, **settings):
    return judge_memory(dataclasses.replace(PARAMETERS, **settings), memory, packet_at(now, path), target_at(now))


def target_at(stamp):
    """What the servo says 0.29 s after the newest measurement."""
    target = ServoTarget(np.zeros(14))
    target.time, target.stamp = stamp + 0.29, stamp
    return target


def test_touch_delay_and_horizon_add_up():
    parameters = dataclasses.replace(
        PARAMETERS, jaw_opening=0.088, object_width=0.04, descent_duration=0.36, closing_lead=0.10
    )
    assert touch_delay(parameters) == pytest.approx(0.12)
    target = ServoTarget(np.zeros(14))
    target.time, target.stamp = 10.046, 9.75
    # age of what was seen .296, descent .36, of which the last .10 is closing time already, jaws .12
    assert horizon(parameters, target) == pytest.approx(0.296 + 0.36 - 0.10 + 0.12)


def test_predictions_that_came_true_here_open_the_gate():
    assert judge(memory_of(*pass_here(30.0)), 30.0) == (Gate.OPEN, 0.0)


@pytest.mark.parametrize(
    "error, allowed",
    [
        ("lateral", PARAMETERS.lateral_tolerance),
        ("along", PARAMETERS.along_tolerance),
        ("turn_deg", PARAMETERS.turn_tolerance_deg),
    ],
)
@pytest.mark.parametrize("sign", [-1, 1])
def test_one_failed_prediction_in_either_direction_shuts_it(error, allowed, sign):
    good = pass_here(30.0)
    for share, expected in ((0.99, Gate.OPEN), (1.01, Gate.PREDICTIONS_FAILED)):
        one = record(20.15, circle(30.0), **{error: sign * share * allowed})
        verdict, worst = judge(memory_of(*good, one), 30.0)
        assert verdict == expected
        assert worst == pytest.approx(share * allowed if error == "lateral" else 0.0)


def test_too_few_records_are_no_evidence():
    assert judge(PredictionMemory(), 30.0) == (Gate.NO_MEMORY, 0.0)
    assert judge(memory_of(*pass_here(30.0, count=FEWEST_RECORDS - 1)), 30.0)[0] == Gate.NO_MEMORY
    assert judge(memory_of(*pass_here(30.0, count=FEWEST_RECORDS)), 30.0)[0] == Gate.OPEN


def test_the_newest_earlier_pass_counts_and_not_the_ones_before():
    bad_long_ago = pass_here(30.0, at=20.0, lateral=0.05)
    assert judge(memory_of(*bad_long_ago, *pass_here(30.0)), 30.0)[0] == Gate.OPEN
    bad_lately = pass_here(30.0, at=10.0, lateral=0.05)
    assert judge(memory_of(*pass_here(30.0, at=20.0), *bad_lately), 30.0)[0] == Gate.PREDICTIONS_FAILED
    assert ONE_PASS < 10.0


def judge_with(std, memory, now=30.0, **settings):
    """The verdict on a prediction whose filter says that it is off by ``std`` [m]."""
    times = now + KNOT_SPACING * np.arange(KNOT_COUNT)
    packet = pack_prediction(now, 1, np.column_stack([circle(times), np.full(KNOT_COUNT, std)]))
    return judge_prediction(dataclasses.replace(PARAMETERS, **settings), memory, packet, target_at(now))[0]


def lately(now=30.0, **error):
    """Predictions of the last second, judged: from all along the way, not from this place."""
    stamps = now - horizon(PARAMETERS, ServoTarget(np.append([0.29], np.zeros(13)))) - np.linspace(0.9, 0.0, 10)
    return memory_of(*(record(stamp, circle(stamp), **error) for stamp in stamps))


def test_a_filter_with_a_small_std_that_was_right_recently_is_trusted():
    sure, unsure = 0.9 * PARAMETERS.std_tolerance, 1.1 * PARAMETERS.std_tolerance
    assert judge_with(sure, lately()) == Gate.OPEN
    assert judge_with(unsure, lately()) == Gate.NO_MEMORY
    assert judge_with(sure, lately(lateral=0.02)) == Gate.NO_MEMORY
    assert judge_with(sure, PredictionMemory()) == Gate.NO_MEMORY
    assert judge_with(sure, lately(), gate="memory") == Gate.NO_MEMORY


def test_a_filter_with_a_large_std_is_trusted_where_it_was_right_before():
    assert judge_with(0.02, memory_of(*pass_here(30.0))) == Gate.OPEN


def test_places_beyond_the_radius_are_not_used(monkeypatch):
    elsewhere = [record(20.0 + 0.03 * k, circle(30.0) + [0.04, 0, 0, 0], lateral=0.0) for k in range(5)]
    assert judge(memory_of(*elsewhere), 30.0)[0] == Gate.NO_MEMORY
    monkeypatch.setattr(GraspConfig, "memory_radius", 0.05)
    assert judge(memory_of(*elsewhere), 30.0)[0] == Gate.OPEN


def watched(until, path, start=1.0):
    memory = PredictionMemory()
    for stamp in np.arange(start, until, 0.03):
        memory = remember(memory, packet_at(stamp, path), 0.7)
    return memory


def test_an_open_track_is_accepted_only_after_the_straight_length():
    # .25 m at .15 m/s takes 1.67 s; of what was seen the first second does not count
    for duration, expected in ((STARTING + 1.55, Gate.NO_MEMORY), (STARTING + 1.80, Gate.OPEN)):
        now = 1.0 + duration
        memory = watched(now, straight)
        assert judge(memory, now, straight)[0] == expected
        assert is_straight(PARAMETERS, memory, packet_at(now, straight)) == (expected == Gate.OPEN)


def test_a_bend_is_not_straight_however_long_it_was_watched():
    memory = watched(4.0, circle)
    short, loose = {"straight_length": 0.15}, {"straight_length": 0.15, "straight_tolerance": 0.1}
    assert not is_straight(variant(GraspConfig, **short)(), memory, packet_at(4.0, circle))
    assert is_straight(variant(GraspConfig, **loose)(), memory, packet_at(4.0, circle))
    assert judge(memory, 4.0, circle)[0] == Gate.NO_MEMORY


def test_a_straight_after_a_bend_is_no_open_track():
    def bend_then_straight(t):
        t = np.asarray(t, dtype=float)
        bend = circle(np.minimum(t, 4.0))
        heading = circle(4.0)[3]
        beyond = 0.15 * np.maximum(t - 4.0, 0.0)[..., None] * np.array([np.cos(heading), np.sin(heading), 0.0, 0.0])
        return bend + beyond

    for now in (5.0, 6.5, 9.0):
        assert not is_straight(PARAMETERS, watched(now, bend_then_straight), packet_at(now, bend_then_straight))
    only_straight = watched(7.0, bend_then_straight, start=4.0)
    assert is_straight(PARAMETERS, only_straight, packet_at(7.0, bend_then_straight))


def test_the_start_of_the_filter_beside_the_line_is_ignored():
    def begins_beside(t):
        off = 0.02 * (np.asarray(t) < 1.0 + 0.9 * STARTING)
        return straight(t) + off[..., None] * np.array([1.0, 0.0, 0.0, 0.0])

    assert is_straight(PARAMETERS, watched(5.0, begins_beside), packet_at(5.0, begins_beside))


def test_a_prediction_that_leads_elsewhere_than_before_is_not_trusted():
    """However well those made from here a lap earlier came true."""
    memory = memory_of(*pass_here(30.0))
    here = circle(30.0)

    def leaves(t):
        way = 0.15 * (np.asarray(t)[..., None] - 30.0)
        return here + way * np.array([np.cos(here[3]), np.sin(here[3]), 0.0, 0.0])

    verdict, worst = judge(memory, 30.0, leaves)
    assert verdict == Gate.PREDICTIONS_FAILED
    # a chord of .105 m off a circle of .12 m radius: the object went .041 m to the left of the tangent
    assert worst == pytest.approx(0.12 * (1.0 - np.cos(0.15 * 0.7 / 0.12)), abs=1e-3)


@pytest.mark.parametrize("share, expected", [(0.9, Gate.OPEN), (1.1, Gate.PREDICTIONS_FAILED)])
@pytest.mark.parametrize("off", ["across", "turned"])
def test_a_prediction_may_differ_from_the_earlier_path_by_the_tolerances(off, share, expected):
    outward = np.array([np.cos(THERE[3] - np.pi / 2), np.sin(THERE[3] - np.pi / 2), 0.0, 0.0])
    there = THERE + share * (
        PARAMETERS.lateral_tolerance * outward
        if off == "across"
        else np.array([0.0, 0.0, 0.0, np.deg2rad(PARAMETERS.turn_tolerance_deg)])
    )
    memory = memory_of(*(record(20.0 + 0.03 * k, circle(30.0), there=there) for k in range(5)))
    assert judge(memory, 30.0)[0] == expected


def test_neither_the_time_of_arrival_nor_records_from_farther_away_matter():
    """An object may be slower than a lap ago; and records are asked from nearby first."""
    faster = memory_of(*(record(20.0 + 0.03 * k, circle(30.0), there=circle(30.9)) for k in range(5)))
    assert strays(packet_at(30.0, circle), faster.records) == pytest.approx((0.0, 0.0), abs=2e-3)
    farther = [record(20.3, circle(30.1), there=THERE + [0.1, 0.0, 0.0, 0.0])]
    rows = memory_of(*pass_here(30.0), *farther).records
    assert strays(packet_at(30.0, circle), rows) == pytest.approx((0.0, 0.0), abs=2e-3)


def test_on_a_straight_the_recent_predictions_must_have_come_true():
    memory = watched(4.0, straight)
    assert judge(memory, 4.0, straight)[0] == Gate.OPEN
    rows = memory.records.copy()
    rows[-1, 4] = 0.02
    assert judge(PredictionMemory(memory.waiting, rows), 4.0, straight) == (Gate.PREDICTIONS_FAILED, 0.02)


def test_the_gate_setting_decides_which_evidence_is_used():
    memory = watched(4.0, straight)
    assert judge(memory, 4.0, straight, gate="memory")[0] == Gate.NO_MEMORY
    on_bend = watched(4.0, circle)
    assert judge(on_bend, 4.0, circle, gate="recent")[0] == Gate.OPEN
    assert judge(on_bend, 4.0, circle, gate="auto")[0] == Gate.NO_MEMORY
    # a bad memory of the place is not excused by a straight path
    bad = [record(1.0 + 0.03 * k, straight(4.0), lateral=0.05) for k in range(5)]
    both = PredictionMemory(memory.waiting, np.vstack([np.array(bad), memory.records]))
    assert judge(both, 4.0, straight)[0] == Gate.PREDICTIONS_FAILED


@pytest.fixture(scope="module")
def hovering(arm_model):
    """Joints with the hand over the object of the packet stamped 1.0, at the instant 1.3."""
    x, y, z, yaw = circle(1.3)
    over = tool_down([x, y, z + PARAMETERS.hover_height], yaw + np.pi)
    return joints_for(arm_model, PUMA560.q_start, over), 1.3


def follow(arm_model, hovering, path=circle, **settings):
    q, start = hovering
    parameters = dataclasses.replace(PARAMETERS, **settings)
    ik_parameters = make_parameters(arm_model, SERVO_PERIOD)
    height, duration = parameters.hover_height, parameters.descent_duration
    return can_follow(parameters, arm_model, ik_parameters, q, packet_at(1.0, path), start, height, 1, duration)


def test_an_object_stands_when_its_whole_predicted_path_stays_in_place():
    assert stands(packet_at(1.0, lambda t: np.broadcast_to([0.5, 0.1, 0.48, 1.0], (len(t), 4))))
    assert not stands(packet_at(1.0, lambda t: np.column_stack([0.5 + 0.01 * (t - 1.0), 0 * t, 0 * t, 0 * t])))
    assert not stands(packet_at(1.0, circle))


def test_the_arm_can_follow_the_default_descent(arm_model, hovering):
    assert follow(arm_model, hovering)


def test_a_hand_that_follows_the_tilt_rehearses_it(arm_model, hovering, monkeypatch):
    heard = []
    monkeypatch.setattr("drake_tracker.grasp.gate.rehearse", lambda *question: heard.append(list(question[3])) or True)

    def climbs(t):
        return circle(t) + np.asarray(t)[..., None] * [0.0, 0.0, 0.03, 0.0]

    assert follow(arm_model, hovering, climbs, follow_tilt=True) and follow(arm_model, hovering, climbs)
    tilted, vertical = ([pose.rotation().matrix()[:, 2] for pose in poses] for poses in heard)
    np.testing.assert_allclose(vertical, np.tile([0.0, 0.0, -1.0], (len(vertical), 1)), atol=1e-12)
    leans = np.degrees(np.arccos(-np.array(tilted)[:, 2]))
    assert np.all(np.diff(leans) >= 0.0) and leans[0] < 1.0
    assert leans[-1] == pytest.approx(np.degrees(np.arctan(0.03 / 0.15)), abs=0.5)


def test_it_can_neither_descend_too_fast_nor_follow_a_fast_or_distant_object(arm_model, hovering):
    assert not follow(arm_model, hovering, descent_duration=0.1)
    _, start = hovering

    def runs_away(t):
        return circle(start) + (np.asarray(t)[..., None] - start) * np.array([3.0, 0.0, 0.0, 0.0])

    assert not follow(arm_model, hovering, runs_away)
    assert not follow(arm_model, hovering, lambda t: circle(t) + [0.05, 0.0, 0.0, 0.0])
    assert not follow(arm_model, hovering, lambda t: circle(t) + [0.6, 0.0, 0.0, 0.0])


def test_the_path_after_the_descent_counts_too(arm_model, hovering):
    _, start = hovering
    turning = start + PARAMETERS.descent_duration + 0.02  # on the way still when the jaws close

    def bolts(t):
        t = np.asarray(t, dtype=float)
        return circle(np.minimum(t, turning)) + np.maximum(t - turning, 0.0)[..., None] * [3.0, 0.0, 0.0, 0.0]

    assert not follow(arm_model, hovering, bolts)


def test_the_rehearsal_is_the_descent_of_the_hand_set_point_by_set_point(arm_model, hovering, monkeypatch):
    heard = {}

    def listen(model, ik_parameters, q, poses, tolerance):
        heard.update(q=q, poses=list(poses), tolerance=tolerance)
        return True

    monkeypatch.setattr("drake_tracker.grasp.gate.rehearse", listen)
    assert follow(arm_model, hovering)
    q, start = hovering
    assert heard["q"] is q and heard["tolerance"] <= 0.005
    blind = PARAMETERS.descent_duration + touch_delay(PARAMETERS)
    assert len(heard["poses"]) == np.ceil(blind / SERVO_PERIOD)
    for k, X_WT in enumerate(heard["poses"], start=1):  # the set-point of ``start`` has been given already
        x, y, z, yaw = circle(start + k * SERVO_PERIOD)
        left = 1.0 - share_done(k * SERVO_PERIOD / PARAMETERS.descent_duration)
        height = left * PARAMETERS.hover_height + (1.0 - left) * PARAMETERS.grasp_height
        expected = tool_down([x, y, z + height], yaw + np.pi)
        np.testing.assert_allclose(X_WT.translation(), expected.translation(), atol=5e-4)  # knots are .05 s apart
        np.testing.assert_allclose(X_WT.rotation().matrix(), expected.rotation().matrix(), atol=1e-3)
