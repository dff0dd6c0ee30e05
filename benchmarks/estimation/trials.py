"""Trials beside the cells: the world that the coordinated turn assumes, a track that is moved, Rice's law, the link.

Each is a function of a seed (and the frozen parameters) that returns a dict of numbers, as a line of the results keeps.
"""

import math

import numpy as np
from bounds import turn_world_bound
from contestants import contestant
from measure import HORIZONS, follow, rounded
from worlds import HEIGHT, PERIOD, make_world

from drake_tracker.arm.motion.servo import Servo
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, pack_prediction
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.estimation import make_estimator
from drake_tracker.estimation.parts import TurnFilter
from drake_tracker.estimation.parts.rice import mean_factor
from drake_tracker.estimation.parts.turn_model import turn_step
from drake_tracker.link.config import Lossy
from drake_tracker.link.lossy_link import LossyLink

SIGMA_MM = 1.0
SIGMA = 1e-3 * SIGMA_MM
DRIVES = 60
"""Trajectories of the own world for each seed."""
SEEN = 3.0
"""Time [s] for which points are seen in it."""
START_MEAN, START_STD = (0.15, 0.0), (0.02, 3.0)
"""Speed [m/s] and curvature [1/m] there at first."""
SLOW = 0.04
"""A trajectory that comes below this speed [m/s] is drawn again: there the noise of the bend all but ends, and with it
what the recursion can invert."""
MOVED_BY = np.array([0.04, -0.03])
"""Of the track [m], in the trial of a moved one, with a turn of `MOVED_TURN` [rad] about its middle."""
MOVED_TURN = 0.4
LAPS_BEFORE, LAPS_AFTER = 2.3, 2.2
BACK = 3.0
"""Error at the grasp horizon [mm] below which the estimator is back on the path."""
RATIOS = (2.5, 4.0, 8.0)
"""s_0 over the noise of the difference of two points, in the trial of Rice's law."""
BASELINE = 3
"""Frames of its chords."""
LAG = 0.25
"""From a point's capture until its prediction is sent [s]."""
LINKS = {
    "perfect": {},
    "drops": {"drop": 0.5},
    "jitter": {"drop": 0.5, "jitter": 0.1},
    "bursts": {"drop": 0.5, "burst": 12.0},
    "late": {"drop": 0.5, "jitter": 0.1, "delay": 0.2, "burst": 12.0},
}


def own_world(seed, parameters):
    """Returns mean squares [mm^2] of coordinated_turn in the world that it assumes, and their bound, by horizon."""
    rng = np.random.default_rng([seed, 1])
    model = TurnFilter()
    ahead = [round(horizon / PERIOD) for horizon in HORIZONS.values()]
    seen = round(SEEN / PERIOD)
    drives = np.array([_wander(model, seen + max(ahead) + 1, rng) for _ in range(DRIVES)])
    squares = []
    for states in drives:
        points = np.column_stack([states[: seen + 1, :2], np.full(seen + 1, HEIGHT)])
        points = points + SIGMA * rng.standard_normal(points.shape)
        times = PERIOD * np.arange(seen + 1)
        rows, _ = follow(contestant("coordinated_turn", SIGMA_MM, "constant", parameters), times, points, [seen])
        squares.append([np.sum((rows[0, k, :2] - states[seen + step, :2]) ** 2) for k, step in enumerate(ahead)])
    # Of the place and the heading nothing is known at first.
    information = np.diag([1e-4, 1e-4, 0.1, START_STD[0] ** -2.0, START_STD[1] ** -2.0])
    bound = turn_world_bound(drives, lambda after: _noise_after(model, after), information, SIGMA, PERIOD, ahead)
    return {
        "n": DRIVES,
        "mean_square_mm2": [rounded(1e6 * value) for value in np.mean(squares, axis=0)],
        "bound_mm2": [rounded(1e6 * value) for value in bound],
    }


def _wander(model, n, rng):
    """Returns states (n, 5) of the world that ``model`` assumes, from step to step."""
    while True:
        speed, bend = START_MEAN + np.array(START_STD) * rng.standard_normal(2)
        states = [np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi), speed, bend])]
        while len(states) < n and states[-1][3] > SLOW:
            after, noise = model.propagate(states[-1], np.zeros((5, 5)), PERIOD)
            states.append(after + np.linalg.cholesky(noise) @ rng.standard_normal(5))
        if len(states) == n:
            return states


def _noise_after(model, after):
    """Returns the covariance (5, 5) of the noise of the step that leads to ``after`` without it."""
    return model.propagate(turn_step(after, -PERIOD)[0], np.zeros((5, 5)), PERIOD)[1]


def moved(seed, parameters):
    """Returns after how many laps closed_path is back on the path of a track that was moved, and its errors [mm]."""
    probe = make_world("stadium", "white", SIGMA, "constant", seed, 1.0)
    lap = probe.track.length / probe.speed
    world = make_world("stadium", "white", SIGMA, "constant", seed, (LAPS_BEFORE + LAPS_AFTER) * lap)
    points = world.points.copy()
    later = world.times >= LAPS_BEFORE * lap
    middle = world.track.points.mean(axis=0)
    points[later, :2] = _shift(points[later, :2], middle)
    judged = np.arange(60, len(world.times))
    rows, _ = follow(contestant("closed_path", SIGMA_MM, "constant", parameters), world.times, points, judged)
    truth = world.pose(world.times[judged] + HORIZONS["grasp"])[:, :2]
    after = world.times[judged] >= LAPS_BEFORE * lap
    truth[after] = _shift(truth[after], middle)
    error = 1e3 * np.hypot(*(rows[:, 1, :2] - truth).T)
    laps = world.times[judged] / lap - LAPS_BEFORE
    wrong = np.flatnonzero(after & (error > BACK))
    back = laps[wrong[-1]] if len(wrong) else 0.0
    before = error[(laps > -1.0) & (laps < -HORIZONS["grasp"] / lap)]
    return {
        "laps_until_back": rounded(back),
        "rms_before_mm": rounded(np.sqrt(np.mean(before**2))),
        "rms_after_mm": rounded(np.sqrt(np.mean(error[laps >= 1.2] ** 2))),
    }


def _shift(xy, middle):
    c, s = math.cos(MOVED_TURN), math.sin(MOVED_TURN)
    return middle + MOVED_BY + (xy - middle) @ np.array([[c, s], [-s, c]])


def rice(seed, parameters):
    """Returns for each of `RATIOS` the mean of the recovered s_0, the plain mean of chords, and what Rice's law says of
    the latter, each over the true s_0.
    """
    found = {}
    for ratio in RATIOS:
        s_0 = ratio * math.sqrt(2.0) * SIGMA
        speed = s_0 / (BASELINE * PERIOD)
        times = PERIOD * np.arange(1800)
        rng = np.random.default_rng([seed, 2, round(10 * ratio)])
        points = np.column_stack([speed * times, 0.0 * times, 0.0 * times + HEIGHT])
        points += SIGMA * rng.standard_normal(points.shape)
        filter_ = make_estimator("arc_length", baseline=BASELINE)
        state, recovered = filter_.initial_state(), []
        for k, (time, point) in enumerate(zip(times, points, strict=True)):
            state = filter_.update(state, time, point)
            if k >= 120:
                recovered.append(state.arc.s_0)
        chords = np.hypot(*(points[BASELINE:, :2] - points[:-BASELINE, :2]).T)
        law = mean_factor(ratio) / ratio
        found[f"{ratio:g}"] = [rounded(np.mean(recovered) / s_0), rounded(np.mean(chords) / s_0), rounded(law)]
    return found


def link(seed, parameters):
    """Returns for each of `LINKS` the mean square [mm^2] and the greatest error [mm] of the servo's target, with
    coordinated_turn as the source of packets.
    """
    world = make_world("stadium", "white", SIGMA, "constant", seed, 40.0)
    estimator = make_estimator("coordinated_turn")
    state, packets = estimator.initial_state(), []
    for seq, (time, point) in enumerate(zip(world.times, world.points, strict=True), 1):
        state = estimator.update(state, time, point)
        if estimator.ready(state):
            times = time + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([estimator.predict(state, times), estimator.predict_std(state, times)])
            packets.append((time + LAG, pack_prediction(time, seq, knots)))
    found = {}
    for name, faults in LINKS.items():
        due, places = _serve(LossyLink(Lossy(**faults), seed), packets, world.times[-1])
        error = 1e3 * np.hypot(*(places - world.pose(due)[:, :2]).T)[due >= 2.0]
        found[name] = [rounded(np.mean(error**2)), rounded(np.max(error))]
    return found


def _serve(line, packets, until):
    """Returns the instants [s] for which the servo gave a target, and its places (n, 2) [m]."""
    servo = Servo()
    state, on_line, held, sent = servo.initial_state(), line.initial_state(), None, 0
    due, places = [], []
    for tick in range(1, int(until / SERVO_PERIOD)):
        now = tick * SERVO_PERIOD
        while sent < len(packets) and packets[sent][0] <= now:
            on_line = line.post(on_line, packets[sent][1], packets[sent][0])
            sent += 1
        held = line.delivered(on_line, now)
        if held is not None:
            state = servo.update(state, now, held, False)
            due.append(state.due)
            places.append(servo.target(state)[1:3])
    return np.array(due), np.array(places)


TRIALS = {"own_world": own_world, "moved": moved, "rice": rice, "link": link}
SUBJECTS = {"own_world": "coordinated_turn", "moved": "closed_path", "rice": "arc_length", "link": "coordinated_turn"}
"""Whom each trial tries."""
