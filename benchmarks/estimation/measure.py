"""One run of one cell: every contestant on the same points, and the bounds of that very run."""

import numpy as np
from bounds import closed_path_bound, constant_curvature_floor, curvature_changes, first_lap_bound
from contestants import contestant
from replay import Recording
from worlds import make_world

HORIZONS = {"present": 0.25, "grasp": 0.75}
"""Ahead of the newest point [s]: the lag, and the lag and what a blind grasp takes."""
STAGES = ("first", "between", "after")
"""Of the first lap; until the path has closed for sure; and from `AFTER` laps on, by the way driven."""
AFTER = 1.2
WARM_UP = 1.0
"""Judged is from this time [s] on: every contestant is ready by then."""
EVERY = 3
"""Points between two predictions judged: errors of neighbours are all but the same."""
ARCS = ("stadium", "circle")
"""Paths of constant curvature between jumps."""
COLUMNS = ("n", "mean_square_mm2", "p95_mm", "heading_mean_square_deg2", "inside")
"""What is kept of the errors of one stage at one horizon; inside: share within `predict_std`, None without it."""


def run_cell(path, noise, sigma_mm, law, seed, duration, names, parameters):
    """Returns a dict: results[name][stage][horizon], a list in the order of `COLUMNS`, and bounds[kind], a list of mean
    squares [mm^2] in the order of `HORIZONS`.
    """
    replay = Recording.load() if noise == "replayed" else None
    world = make_world(path, noise, 1e-3 * sigma_mm, law, seed, duration, replay)
    judged = np.arange(round(WARM_UP * 60), len(world.times), EVERY)
    laps = world.distance(world.times[judged]) / world.track.length
    stages = {"first": laps < 1.0, "between": (laps >= 1.0) & (laps < AFTER), "after": laps >= AFTER}
    truth = {horizon: world.pose(world.times[judged] + ahead) for horizon, ahead in HORIZONS.items()}
    results = {}
    for name in names:
        rows, std = follow(contestant(name, sigma_mm, law, parameters, path), world.times, world.points, judged)
        results[name] = {
            stage: {
                horizon: summary(rows[among, k], truth[horizon][among], None if std is None else std[among, k])
                for k, horizon in enumerate(HORIZONS)
            }
            for stage, among in stages.items()
            if among.any()
        }
    return {"results": results, "bounds": bounds_of(world, path, noise, sigma_mm, law, judged, stages)}


def follow(estimator, times, points, judged):
    """Returns predictions (len(judged), horizons, 4) after the points ``judged``, and their std [m] or None."""
    ahead = np.array(list(HORIZONS.values()))
    wanted = {int(index): row for row, index in enumerate(judged)}
    rows = np.empty((len(judged), len(ahead), 4))
    std = np.empty(rows.shape[:2]) if hasattr(estimator, "predict_std") else None
    state = estimator.initial_state()
    for index, (time, point) in enumerate(zip(times, points, strict=True)):
        state = estimator.update(state, time, point)
        if index in wanted:
            rows[wanted[index]] = estimator.predict(state, time + ahead)
            if std is not None:
                std[wanted[index]] = estimator.predict_std(state, time + ahead)
    return rows, std


def summary(rows, truth, std):
    """Returns `COLUMNS` of predictions (n, 4), the truth (n, 3) and standard deviations (n,) [m] or None."""
    away = np.hypot(*(rows[:, :2] - truth[:, :2]).T)
    turn = np.degrees(np.angle(np.exp(1j * (rows[:, 3] - truth[:, 2]))))
    inside = None if std is None else rounded(np.mean(away <= std))
    mean_square = rounded(1e6 * np.mean(away**2))
    return [len(away), mean_square, rounded(1e3 * np.percentile(away, 95)), rounded(np.mean(turn**2)), inside]


def rounded(value):
    return float(f"{value:.4g}")


def bounds_of(world, path, noise, sigma_mm, law, judged, stages):
    """Returns the bounds that hold in this world, which is every one only with white noise at constant speed."""
    if law != "constant":
        return {}
    ahead = list(HORIZONS.values())
    floor = constant_curvature_floor(world.track, world.speed, ahead)
    found = {"floor": floor}
    if noise != "white":
        return _in_square_mm(found)
    sigma, track, speed = 1e-3 * sigma_mm, world.track, world.speed
    if path in ARCS:
        changes = np.sort((curvature_changes(track) - world.start) % track.length)
        edges = np.concatenate([[0.0], changes, [track.length]])
        curvatures = track.curvature(world.start + 0.5 * (edges[1:] + edges[:-1]))
        # What one may know of a curvature beforehand is how large the track's curvatures are.
        known = float(np.sqrt(np.mean(track.curvature(np.linspace(0.0, track.length, 500)) ** 2)))
        present = world.times[judged[stages["first"]]][::2]
        until = world.times[world.times <= present[-1]]
        squares = first_lap_bound(
            until, world.pose([0.0])[0, 2], speed, changes / speed, curvatures, sigma, known, present, ahead
        )
        found["first_lap"] = squares.mean(axis=0) + floor
    after = judged[stages["after"]][::20]
    if len(after):
        tangent = _tangents(world, world.times)
        squares = []
        for index in after:
            seen, query = world.times[: index + 1], world.times[index] + np.array(ahead)
            squares.append(
                closed_path_bound(
                    seen, tangent[: index + 1], query, _tangents(world, query), track.length, speed, sigma
                )
            )
        found["closed_path"] = np.mean(squares, axis=0)
    return _in_square_mm(found)


def _tangents(world, times):
    yaw = world.pose(times)[:, 2]
    return np.column_stack([np.cos(yaw), np.sin(yaw)])


def _in_square_mm(found):
    return {kind: [rounded(1e6 * value) for value in values] for kind, values in found.items()}
