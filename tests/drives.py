"""Small worlds for the tests of estimators: a track, driven by a speed law, seen with white noise."""

import numpy as np

from drake_tracker.world.train.tracks import make_track

PERIOD = 1.0 / 60.0
HEIGHT = 0.485


class Drive:
    """An object on a track: ``speed(t)`` [m/s], points with noise ``sigma`` [m]."""

    def __init__(self, track, speed, duration, sigma=0.001, seed=0):
        self.track = track
        self.times = PERIOD * np.arange(round(duration / PERIOD))
        fine = 0.001 * np.arange(round((duration + 2.0) / 0.001))
        rates = np.array([speed(t) for t in fine]) if callable(speed) else np.full(len(fine), speed)
        self._fine, self._way = fine, np.append(0.0, np.cumsum(0.001 * rates[:-1]))
        noise = sigma * np.random.default_rng(seed).standard_normal((len(self.times), 3))
        self.points = np.column_stack([self.truth(self.times)[:, :2], np.full(len(self.times), HEIGHT)]) + noise

    def truth(self, times):
        """Rows x, y [m], yaw [rad]."""
        return np.column_stack(self.track.pose(np.interp(times, self._fine, self._way)))

    def lap_time(self, speed):
        return self.track.length / speed


def stadium():
    return make_track("stadium", radius=0.175, straight=0.25)


def errors(estimator, times, points, drive, horizon, state=None):
    """Runs an estimator; returns (state, rows of time, horizontal error [m], yaw error [rad], predicted std [m])."""
    state = estimator.initial_state() if state is None else state
    rows = []
    for t, p in zip(times, points, strict=True):
        state = estimator.update(state, t, p)
        if estimator.ready(state):
            x, y, _, yaw = estimator.predict(state, [t + horizon])[0]
            (std,) = estimator.predict_std(state, [t + horizon])
            ((tx, ty, true_yaw),) = drive.truth([t + horizon])
            turn = np.angle(np.exp(1j * (yaw - true_yaw)))
            rows.append((t, np.hypot(x - tx, y - ty), turn, std))
    return state, np.array(rows)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))
