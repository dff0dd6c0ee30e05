"""What no estimator can beat: bounds on the error of a predicted place, of four kinds of knowledge.

`turn_world_bound`: of an object that wanders as the coordinated-turn filter supposes.
`first_lap_bound`: of a track of straights and bends, for one who is told when the curvature changed.
`closed_path_bound`: of a smooth closed path of unknown shape, driven evenly for a lap and more.
`constant_curvature_floor`: what even a perfect fix of the present leaves to one who goes on along its circle.

The first three are Cramer-Rao bounds of Bayesian kind (Van Trees 1968, section 2.4): the inverse of the information in
the points and in what is known beforehand. Errors are mean squares [m^2] of the horizontal distance, x and y together.
"""

import numpy as np

from drake_tracker.estimation.parts.periodic_path import basis, harmonics_of, prior
from drake_tracker.estimation.parts.turn_model import CURVATURE, HEADING, SPEED, X, Y, turn_step

CHANGE = 0.5
"""Curvature that changes by more than this [1/m] within `CHANGE_OVER` [m] has jumped."""
CHANGE_OVER = 0.01


def information_step(information, d11, d12, d22):
    """Returns the information (n, n) on the next state, from that on this one.

    Tichavsky, Muravchik and Nehorai, IEEE Trans. Signal Processing 46 (1998), equation 21. With x' = f(x) + w,
    w ~ N(0, Q), F the Jacobian of f, and M the information in a measurement of x': d11 = E[F^T Q^-1 F],
    d12 = -E[F^T Q^-1], d22 = E[Q^-1] + M. In a linear world it is the information form of the Kalman filter.
    """
    return d22 - d12.T @ np.linalg.solve(information + d11, d12)


def turn_world_bound(trajectories, noises, information, sigma, period, ahead):
    """Returns the mean square [m^2] below which no prediction made at the last measurement can come, shape (steps,):
    one value for each number of steps ``ahead`` (a sequence of whole numbers).

    Args:
      trajectories: states (runs, n, 5) drawn from the world, in the order of `coordinated_turn`. noises: a function of
      a state after a step that returns the covariance (5, 5) of the step's noise. information: (5, 5), of the first
      state. sigma: noise of a point, per axis [m]. period: time of a step [s].

    The world is x' = turn_step(x) + w, w ~ N(0, Q(x)). Points are taken of all states but the last max(ahead): those
    are the future, in which the recursion runs on without measurements.

    The recursion runs along each trajectory, with F and Q where the truth is, and the bounds are averaged over the
    trajectories: to one who is told F and Q the world is linear and Gaussian, and to him the bound is exact. Averaging
    F^T Q^-1 F over trajectories first, as one may, gives a bound that holds as well and says nothing here: a step's
    noise across the path is below a micrometre, so that the mere difference between the F of two trajectories would
    count as a huge information. What Q, which depends on the state, would itself tell of the state is left out.
    """
    measured = np.zeros((5, 5))
    measured[X, X] = measured[Y, Y] = sigma**-2
    present = trajectories.shape[1] - 1 - max(ahead)
    squares = np.zeros(len(ahead))
    for states in trajectories:
        known, bounds = information, {}
        for k, state in enumerate(states[:-1]):
            after, jacobian = turn_step(state, period)
            weight = np.linalg.inv(noises(after))
            seen = measured if k + 1 <= present else 0.0
            d12 = -jacobian.T @ weight
            known = information_step(known, -d12 @ jacobian, d12, weight + seen)
            known = 0.5 * (known + known.T)
            if k + 1 - present in ahead:
                bounds[k + 1 - present] = np.trace(np.linalg.inv(known)[:2, :2])
        squares += [bounds[step] for step in ahead]
    return squares / len(trajectories)


def curvature_changes(track):
    """Returns the arc lengths (m,) [m] at which the curvature of a closed track jumps."""
    step = 0.5e-3
    s = np.arange(0.0, track.length, step)
    jump = np.abs(track.curvature(s + 0.5 * CHANGE_OVER) - track.curvature(s - 0.5 * CHANGE_OVER))
    first = int(np.argmin(jump))  # begin between two jumps
    s, jump = np.roll(s, -first), np.roll(jump, -first)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (jump > CHANGE).astype(int), [0]])))
    return np.sort([s[start + int(np.argmax(jump[start:stop]))] for start, stop in zip(edges[::2], edges[1::2])])


def first_lap_bound(times, start, speed, changes, curvatures, sigma, curvature_std, present, ahead):
    """Returns mean squares [m^2], shape (len(present), len(ahead)): row i of predictions made at ``present[i]`` [s].

    Args:
      times: of the points (n,) [s], the first of them at 0. start: heading there [rad]. speed: [m/s].
      changes: times (m,) [s] at which the curvature changes. curvatures: (m + 1,) [1/m] between them. sigma: noise of
      a point, per axis [m]. curvature_std: what is known of each curvature beforehand [1/m]; infinity for nothing.
      present: times (k,) [s], of ``times``. ahead: horizons (h,) [s].

    The path is laid from one circular arc to the next at constant speed: parameters are the first place and heading,
    the speed, and one curvature for each piece begun. One who is told the times of change, and nothing else, has the
    information J = sum S^T S / sigma^2, S the derivative of a point by the parameters, carried along the path by the
    chain rule through `coordinated_turn.turn_step` (exact for an arc); a change makes the curvature a new parameter.
    The pieces before the present one tell of it the place, the heading and the speed; points within a new piece tell
    its curvature, and until there are enough of them, what is known beforehand bounds it.

    The next change, its time and its size, is *not* known: predictions go on with the present curvature. To one who
    knows nothing of it that part of the error comes on top, and `constant_curvature_floor` gives it: changes to the
    left and to the right being as likely, it is uncorrelated with the noise, and mean squares add.
    """
    pieces = len(curvatures)
    state = np.array([0.0, 0.0, start, speed, curvatures[0]])
    known = np.zeros(4 + pieces)
    known[4:] = curvature_std**-2.0
    derivative = np.zeros((5, 4 + pieces))
    derivative[[X, Y, HEADING, SPEED, CURVATURE], [0, 1, 2, 3, 4]] = 1.0
    information = np.diag(known)
    piece, now, rows = 0, times[0], []
    wanted = np.round(np.asarray(present), 9)
    for time in times:
        while piece < len(changes) and changes[piece] <= time:
            state, derivative = _carry(state, derivative, changes[piece] - now)
            now = changes[piece]
            piece += 1
            state[CURVATURE] = curvatures[piece]
            derivative[CURVATURE] = 0.0
            derivative[CURVATURE, 4 + piece] = 1.0
        state, derivative = _carry(state, derivative, time - now)
        now = time
        information += derivative[:2].T @ derivative[:2] / sigma**2
        if np.round(time, 9) in wanted:
            used = 5 + piece  # a piece not begun is no parameter yet
            covariance = np.linalg.inv(information[:used, :used])
            later = [_carry(state, derivative, step)[1][:2, :used] for step in ahead]
            rows.append([np.trace(reach @ covariance @ reach.T) for reach in later])
    return np.array(rows)


def _carry(state, derivative, step):
    later, jacobian = turn_step(state, step)
    return later, jacobian @ derivative


def closed_path_bound(times, tangents, query, query_tangents, length, speed, sigma, prior_std=None):
    """Returns mean squares [m^2], shape (q,), of places at times ``query`` (q,) [s] predicted from points at ``times``.

    Args:
      times: of the points (n,) [s]. tangents, query_tangents: unit vectors (n, 2), (q, 2) of the path there.
      length: of the lap [m]. speed: [m/s]. sigma: noise of a point, per axis [m]. prior_std: of the coefficients
      (2 harmonics + 1,) [m]; by default what `periodic_path.prior` supposes.

    The path is p = B(w t) c, a Fourier series of unknown coefficients c with a Gaussian prior, the same in x and y;
    unknown is also w, the lap's angular rate: how fast it is driven. The start phase is unknown too, but costs
    nothing: a shift of the phase turns each pair of coefficients of a harmonic, the prior is the same after that turn,
    and what is predicted is a place, so the phase may be counted from the first point. With the rows b of B and
    dp/dw = (v / w) t u, u the tangent, linearised at the truth, the information on (c_x, c_y, w) is

        A = B^T B / sigma^2 + prior^-2 for c_x and c_y each, G = B^T (v t u / w) / sigma^2 between them and w, and
        g = sum (v t / w)^2 / sigma^2 for w,

    and w is found from what the path does not explain, r = g - tr(G^T A^-1 G). A predicted place has variance
    2 b^T A^-1 b from the path, and |(v / w) t u - G^T A^-1 b|^2 / r from w. That the path is driven evenly ties its
    label to its arc length; an estimator that used this would know a little more than is supposed here.
    """
    harmonics = harmonics_of(length) if prior_std is None else len(prior_std) // 2
    prior_std = prior(length, harmonics) if prior_std is None else prior_std
    rows, query_rows = (basis(speed * np.asarray(t), length, harmonics) for t in (times, query))
    rate = 2.0 * np.pi * speed / length
    swing = (speed / rate * np.asarray(times))[:, None] * tangents
    query_swing = (speed / rate * np.asarray(query))[:, None] * query_tangents
    inverse = np.linalg.inv(rows.T @ rows / sigma**2 + np.diag(np.asarray(prior_std) ** -2.0))
    mixed = rows.T @ swing / sigma**2
    rest = np.sum(swing**2) / sigma**2 - np.trace(mixed.T @ inverse @ mixed)
    from_path = 2.0 * np.einsum("ij,jk,ik->i", query_rows, inverse, query_rows)
    from_rate = np.sum((query_swing - query_rows @ inverse @ mixed) ** 2, axis=1) / rest
    return from_path + from_rate


def constant_curvature_floor(track, speed, horizons, samples=2000):
    """Returns mean squares [m^2] without noise, shape of ``horizons`` [s], of a prediction along the present circle.

    Place, heading, speed [m/s] and curvature are known exactly, and the object goes on along that circle, while the
    `Track` does what it does. The mean is over ``samples`` places all along a closed track.
    """
    s = track.length * np.arange(samples) / samples
    states = np.column_stack([*track.pose(s), np.full(samples, speed), track.curvature(s)])
    squares = []
    for horizon in np.asarray(horizons, dtype=float):
        later = np.array([turn_step(state, horizon)[0][:2] for state in states])
        truth = np.column_stack(track.pose(s + speed * horizon)[:2])
        squares.append(np.mean(np.sum((later - truth) ** 2, axis=1)))
    return np.array(squares)
