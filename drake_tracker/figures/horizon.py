"""The figure that the paper lacks: how the error of each estimator grows with the time it predicts ahead.

A synthetic stadium seen at 60 Hz with white noise, so that nothing but the estimators differs.
"""

from typing import NamedTuple

import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation import make_estimator
from drake_tracker.figures.paper_style import head, quiet_grid, sheet
from drake_tracker.figures.statistics import mean_interval
from drake_tracker.tasks.style import FAR_PREDICTED, FILTERED, HAND, INK, PREDICTED, SEEN, SOFT_INK
from drake_tracker.world.tracks import Track, make_track

SIGMA = 0.001
"""Noise of a point, per axis [m]."""
SPEED = 0.15
"""[m/s]"""
HEIGHT = 0.485
HORIZONS = np.linspace(0.0, 1.5, 31)
"""Times ahead of the newest point [s]; a packet holds 1.5 s."""
MARKS = ((0.25, "present"), (0.75, "grasp"))
"""Horizons that matter [s]: the lag of vision, and what a blind grasp takes from the image to the touch."""
LAPS, CLOSED_FROM = 3.0, 2.0
"""Laps driven, and the lap from whose end on the path counts as known."""
LEAST_SHOWN = 0.0001
"""Where the axis of errors begins [m]: a bound without noise goes to nothing."""
EVERY = 6
"""A prediction is judged every so many points."""
STAGES = {"first_lap": "First lap", "after_closure": "From the third lap on"}
KINDS = ("arc_length", "alpha_beta_gamma", "coordinated_turn", "closed_path")
"""Estimators of something that drives round a track."""
LITERAL = "arc_length, literal"
_LOOKS = {
    "arc_length": (PREDICTED, "-", "arc length"),
    LITERAL: (FILTERED, (0, (4, 2)), "arc length, chords of one frame"),
    "alpha_beta_gamma": (SEEN, "-", "alpha-beta-gamma"),
    "coordinated_turn": (FAR_PREDICTED, "-", "coordinated turn"),
    "closed_path": (HAND, "-", "closed path"),
}
_BOUND_LOOKS = ((0, (1, 1.4)), (0, (5, 1.5, 1, 1.5)), (0, (6, 1.5)), (0, (3, 1, 1, 1, 1, 1)))


class Drive(NamedTuple):
    """An object on a track: the `Track`, speed [m/s], start [m], times (n,) [s], points (n, 3) [m, W]."""

    track: Track
    speed: float
    start: float
    times: np.ndarray
    points: np.ndarray

    def pose(self, times):
        """Returns x, y [m] and yaw [rad] at ``times`` [s], three arrays of their shape."""
        return self.track.pose(self.start + self.speed * np.asarray(times))


def make_drive(seed, laps=LAPS, speed=SPEED, sigma=SIGMA):
    """Returns a `Drive` of some laps round the stadium at ``speed`` [m/s].

    The seed draws direction, start and noise.
    """
    rng = np.random.default_rng(seed)
    track = make_track("stadium", radius=0.175, straight=0.25)
    if rng.random() < 0.5:
        track = track.reversed()
    times = VISION_PERIOD * np.arange(int(laps * track.length / speed / VISION_PERIOD))
    drive = Drive(track, speed, rng.uniform(0.0, track.length), times, np.zeros((0, 3)))
    x, y, _ = drive.pose(times)
    truth = np.column_stack([x, y, np.full(len(times), HEIGHT)])
    return drive._replace(points=truth + sigma * rng.standard_normal(truth.shape))


def horizon_errors(estimator, drive, horizons=HORIZONS, every=EVERY):
    """Returns (times (k,) [s], errors (k, len(horizons)) [m]): horizontal distance of each prediction from what came.

    Of every sixth point from which on the estimator is ready.
    """
    state = estimator.initial_state()
    times, errors = [], []
    for k, (time, point) in enumerate(zip(drive.times, drive.points, strict=True)):
        state = estimator.update(state, time, point)
        if k % every == 0 and estimator.ready(state):
            x, y, _ = drive.pose(time + horizons)
            rows = estimator.predict(state, time + horizons)
            times.append(time)
            errors.append(np.hypot(rows[:, 0] - x, rows[:, 1] - y))
    return np.array(times), np.array(errors).reshape(-1, len(horizons))


def estimators():
    """Returns {name: estimator} of every kind at its defaults, and of the arc length read literally."""
    kinds = {kind: make_estimator(kind) for kind in KINDS}
    return {**kinds, LITERAL: make_estimator("arc_length", mode="literal")}


def error_against_horizon(seed, runs, bounds=None, progress=None):
    """Returns the numbers of the figure: for each estimator and stage the rms error [m] over the horizons, and the 95 %
    interval of it by a bootstrap over runs.

    ``bounds``: what `read_bounds` returned. ``progress``: called with (run, runs) before each.
    """
    squares = {name: {stage: [] for stage in STAGES} for name in estimators()}
    for run in range(runs):
        drive = make_drive([seed, 3, run], laps=LAPS)
        lap = drive.track.length / drive.speed
        if progress is not None:
            progress(run, runs)
        for name, estimator in estimators().items():
            times, errors = horizon_errors(estimator, drive)
            for stage, inside in (("first_lap", times <= lap), ("after_closure", times >= CLOSED_FROM * lap)):
                squares[name][stage].append(np.mean(errors[inside] ** 2, axis=0))
    rng = np.random.default_rng([seed, 4])
    curves = {}
    for name, stages in squares.items():
        curves[name] = {}
        for stage, rows in stages.items():
            low, high = mean_interval(rows, rng)
            curves[name][stage] = {"rms_m": np.sqrt(np.mean(rows, axis=0)), "low_m": low**0.5, "high_m": high**0.5}
    return {
        "track": "stadium, straights 0.25 m, radius 0.175 m",
        "sigma_m": SIGMA,
        "speed_m_s": SPEED,
        "runs": runs,
        "seed": seed,
        "laps": LAPS,
        "horizon_s": HORIZONS,
        "estimators": curves,
        "bounds": bounds or [],
    }


def draw_error_against_horizon(numbers):
    """Returns the figure: one panel while the path is new, one when it has been driven before."""
    with sheet(13.0, 6.0) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        horizons, seen = numbers["horizon_s"], {}
        for axes, (stage, title) in zip(panels, STAGES.items()):
            for horizon, name in MARKS:
                axes.axvline(horizon, color=SOFT_INK, lw=0.9, ls=(0, (2, 3)), zorder=0)
                axes.annotate(
                    name,
                    (horizon, 0.0),
                    xycoords=("data", "axes fraction"),
                    xytext=(4, 5),
                    textcoords="offset points",
                    color=SOFT_INK,
                    fontsize=10,
                )
            for name, stages in numbers["estimators"].items():
                colour, look, label = _LOOKS.get(name, ("#cc79a7", "-", name.replace("_", " ")))
                curve = {key: 1e3 * np.asarray(row) for key, row in stages[stage].items()}
                axes.fill_between(horizons, curve["low_m"], curve["high_m"], color=colour, alpha=0.18, lw=0)
                # Broad and behind: before the path has closed the closed path is the coordinated turn.
                width = 4.5 if name == "closed_path" else 2.0
                look = dict(color=colour, ls=look, lw=width, zorder=2.0 - 0.1 * width)
                (seen[label],) = axes.plot(horizons, curve["rms_m"], **look)
            for k, bound in enumerate(numbers["bounds"]):
                if bound["stage"] not in (stage, "both"):
                    continue
                look = _BOUND_LOOKS[k % len(_BOUND_LOOKS)]
                (seen[bound["name"]],) = axes.plot(
                    bound["horizon_s"], 1e3 * np.asarray(bound["rms_m"]), color=INK, ls=look, lw=1.6
                )
            axes.set(yscale="log", xlim=(0, horizons[-1]), xlabel="time ahead of the newest image  [s]")
            axes.set_ylim(bottom=1e3 * LEAST_SHOWN)
            axes.yaxis.set_major_formatter("{x:g}")
            quiet_grid(axes)
            head(axes, title, _NOTES[stage].format(sigma=1e3 * numbers["sigma_m"], **numbers))
        panels[0].set_ylabel("error of the predicted place, rms  [mm]")
        figure.legend(seen.values(), seen.keys(), loc="outside lower center", ncols=min(len(seen), 5))
    return figure


_NOTES = {
    "first_lap": "Stadium at {speed_m_s:g} m/s, noise {sigma:g} mm per axis, {runs} runs. Bands: 95 % over runs.",
    "after_closure": "The same runs: who has learned the lap predicts along it.",
}
