"""The motion of a ball on an inclined board, in the board's frame B (Nashman and Chaconas 1990, section 5).

B has its origin on the face at the middle of the bottom edge; y_B points up the slope, z_B outward, and x_B is level. A
hollow sphere (inertia I = 2/3 m r^2) that rolls without slipping is driven by gravity and held back by the inertia of
its shell: m a = m g sin(incline) - I a / r^2, hence a = 3/5 g sin(incline) down the slope.

A mean is x, y [m], vx, vy [m/s] of the ball's centre in B, shape (4,); a covariance is (4, 4).
"""

import math

import numpy as np


class RollingBallModel:
    """A ball that rolls down a board and bounces off its side walls.

    Args:
        acceleration: down the slope [m/s^2].
        half_width: largest |x_B| of the ball's centre between the walls [m]; infinite without walls.
        restitution: coefficient of restitution of the walls.
        process_noise: of the velocity [m/s/sqrt(s)].
    """

    def __init__(self, acceleration: float, half_width: float, restitution: float, process_noise: float) -> None:
        self.acceleration = acceleration
        self.half_width = half_width
        self.restitution = restitution
        self.process_noise = process_noise

    def propagate(
        self, mean: np.ndarray, covariance: np.ndarray, dt: float, burst: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns mean and covariance after a time of rolling.

        Args:
            mean: shape (4,).
            covariance: shape (4, 4).
            dt: the time [s].
            burst: additional process noise of the velocity, its variance per second [m^2/s^3].
        """
        later, factor = self.roll(mean, dt), self._cross(mean[0], mean[2], dt)[2]
        F = np.eye(4)
        F[0, 2] = F[1, 3] = dt
        F[0] *= factor
        F[2] *= factor
        Q = (self.process_noise**2 + burst) * np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
        return later, F @ covariance @ F.T + np.kron(Q, np.eye(2))

    def roll(self, mean: np.ndarray, dt: float) -> np.ndarray:
        """Returns the mean ``dt`` [s] later."""
        x, y, vx, vy = mean.tolist()
        x, vx, _ = self._cross(x, vx, dt)
        return np.array([x, y + vy * dt - 0.5 * self.acceleration * dt * dt, vx, vy - self.acceleration * dt])

    def _cross(self, x: float, vx: float, dt: float) -> tuple[float, float, float]:
        """Returns x and vx after ``dt`` [s], and the factor by which bounces have multiplied a small error of both."""
        factor, half = 1.0, self.half_width
        while abs(x + vx * dt) > half and (x + vx * dt) * vx > 0.0:
            wall = math.copysign(half, vx)
            dt -= max((wall - x) / vx, 0.0)
            x, vx, factor = wall, -self.restitution * vx, -self.restitution * factor
            if abs(factor) < 1e-3:
                break
        return x + vx * dt, vx, factor

    def crossing(self, mean: np.ndarray) -> tuple[float, float]:
        """Returns the time from now until y_B = 0 [s], and the speed down the slope there [m/s]."""
        _, y, _, vy = mean.tolist()
        speed = math.sqrt(max(vy * vy + 2.0 * self.acceleration * max(y, 0.0), 0.0))
        return (vy + speed) / self.acceleration, speed
