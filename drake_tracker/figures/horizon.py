"""A figure that the paper does not have: the error of each estimator over the time that it predicts ahead.

All estimators get the same points: a synthetic drive round a stadium, measured at 60 Hz with white noise.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.estimator import Estimator, make_estimator
from drake_tracker.figures.paper_style import head, quiet_grid, sheet
from drake_tracker.figures.statistics import mean_interval
from drake_tracker.tasks.style import FAR_PREDICTED, FILTERED, HAND, INK, PREDICTED, SEEN, SOFT_INK
from drake_tracker.world.train.tracks import Track, make_track

SIGMA = 0.001
"""Standard deviation of the noise of a point, per axis [m]."""
SPEED = 0.15
"""Speed of the object [m/s]."""
HEIGHT = 0.485
"""Height of the object [m, W]."""
HORIZONS = np.linspace(0.0, 1.5, 31)
"""Times ahead of the newest point [s]; a packet covers 1.5 s."""
MARKS = ((0.25, "present"), (0.75, "grasp"))
"""Horizons that matter [s]: the lag of vision, and the time from the image to the touch in a blind grasp."""
LAPS, CLOSED_FROM = 3.0, 2.0
"""Laps of a drive, and the number of laps after which the path counts as known."""
LEAST_SHOWN = 0.0001
"""Lower limit of the error axis [m]: a bound without noise tends to zero."""
EVERY = 6
"""Number of points from one judged prediction to the next."""
STAGES = {"first_lap": "First lap", "after_closure": "From the third lap on"}
KINDS = ("arc_length", "alpha_beta_gamma", "coordinated_turn", "closed_path")
"""Estimators of an object that drives round a track."""
LITERAL = "arc_length, literal"
_LOOKS = {
    "arc_length": (PREDICTED, "-", "arc length"),
    LITERAL: (FILTERED, (0, (4, 2)), "arc length, chords of one frame"),
    "alpha_beta_gamma": (SEEN, "-", "alpha-beta-gamma"),
    "coordinated_turn": (FAR_PREDICTED, "-", "coordinated turn"),
    "closed_path": (HAND, "-", "closed path"),
}
_BOUND_LOOKS = ((0, (1, 1.4)), (0, (5, 1.5, 1, 1.5)), (0, (6, 1.5)), (0, (3, 1, 1, 1, 1, 1)))


class SyntheticDrive(NamedTuple):
    """An object that drives along a track, and the measured points of it.

    Attributes:
        track: the `Track`.
        speed: of the object [m/s].
        start: position along the track at time 0 [m].
        times: of the points, shape (n,) [s].
        points: with noise, shape (n, 3) [m, W].
    """

    track: Track
    speed: float
    start: float
    times: np.ndarray
    points: np.ndarray

    def pose(self, times: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the true x, y [m] and yaw [rad] at ``times`` [s], three arrays of that shape."""
        return self.track.pose(self.start + self.speed * np.asarray(times))


def make_drive(
    seed: int | Sequence[int], laps: float = LAPS, speed: float = SPEED, sigma: float = SIGMA
) -> SyntheticDrive:
    """Returns a `SyntheticDrive` round the stadium.

    Args:
        seed: of direction, start and noise.
        laps: number of laps.
        speed: of the object [m/s].
        sigma: standard deviation of the noise of a point, per axis [m].
    """
    rng = np.random.default_rng(seed)
    track = make_track("stadium", radius=0.175, straight=0.25)
    if rng.random() < 0.5:
        track = track.reversed()
    times = VISION_PERIOD * np.arange(int(laps * track.length / speed / VISION_PERIOD))
    drive = SyntheticDrive(track, speed, rng.uniform(0.0, track.length), times, np.zeros((0, 3)))
    x, y, _ = drive.pose(times)
    truth = np.column_stack([x, y, np.full(len(times), HEIGHT)])
    return drive._replace(points=truth + sigma * rng.standard_normal(truth.shape))


def horizon_errors(
    estimator: Estimator[Any], drive: SyntheticDrive, horizons: np.ndarray = HORIZONS, every: int = EVERY
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (times (k,) [s], errors (k, len(horizons)) [m]): horizontal distances of predictions from the truth.

    Args:
        estimator: any object with the methods of `Estimator`.
        drive: whose points the estimator gets.
        horizons: times ahead of the newest point [s].
        every: predictions are judged at every so many points, once the estimator is ready.
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


def estimators() -> dict[str, Estimator[Any]]:
    """Returns {name: estimator} for each of `KINDS` with its defaults, and for the literal arc-length estimator."""
    kinds = {kind: make_estimator(kind) for kind in KINDS}
    return {**kinds, LITERAL: make_estimator("arc_length", mode="literal")}


def error_against_horizon(
    seed: int,
    runs: int,
    bounds: Sequence[Mapping[str, Any]] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]:
    """Returns the numbers of the figure: for each estimator and stage, the rms error [m] over the horizons.

    Each comes with its 95 % confidence interval by a bootstrap over runs.

    Args:
        seed: of all runs.
        runs: number of drives.
        bounds: from `read_bounds`.
        progress: called with (run, runs) before each run.
    """
    squares: dict[str, dict[str, list[np.ndarray]]] = {name: {stage: [] for stage in STAGES} for name in estimators()}
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
    curves: dict[str, dict[str, Any]] = {}
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


def draw_error_against_horizon(numbers: Mapping[str, Any]) -> Figure:
    """Returns the figure: one panel for the first lap, one for laps over a known path."""
    with sheet(13.0, 6.0) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        horizons = numbers["horizon_s"]
        shown: dict[str, Any] = {}
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
                # Broad and behind: in the first lap the closed path predicts as the coordinated turn does.
                width = 4.5 if name == "closed_path" else 2.0
                (shown[label],) = axes.plot(
                    horizons, curve["rms_m"], color=colour, ls=look, lw=width, zorder=2.0 - 0.1 * width
                )
            for k, bound in enumerate(numbers["bounds"]):
                if bound["stage"] not in (stage, "both"):
                    continue
                look = _BOUND_LOOKS[k % len(_BOUND_LOOKS)]
                (shown[bound["name"]],) = axes.plot(
                    bound["horizon_s"], 1e3 * np.asarray(bound["rms_m"]), color=INK, ls=look, lw=1.6
                )
            axes.set(yscale="log", xlim=(0, horizons[-1]), xlabel="time ahead of the newest image  [s]")
            axes.set_ylim(bottom=1e3 * LEAST_SHOWN)
            axes.yaxis.set_major_formatter("{x:g}")
            quiet_grid(axes)
            head(axes, title, _NOTES[stage].format(sigma=1e3 * numbers["sigma_m"], **numbers))
        panels[0].set_ylabel("error of the predicted position, rms  [mm]")
        figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=min(len(shown), 5))
    return figure


_NOTES = {
    "first_lap": "Stadium at {speed_m_s:g} m/s, noise {sigma:g} mm per axis, {runs} runs. Bands: 95 % confidence.",
    "after_closure": "The same runs: an estimator that has learned the lap predicts along it.",
}
