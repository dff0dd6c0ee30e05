"""Adaptive process noise of the speed: it rises while the points drift to one side of their expected positions.

Most objects keep their speed nearly all the time and then brake within half a second. While the filter is right, points
lie ahead of and behind the expected position by turns. When they stay on one side, the speed is changing, and the more
they do, the more the noise is raised: an adjustable level of process noise (Bar-Shalom, Li and Kirubarajan, Estimation
with Applications to Tracking and Navigation, 2001, section 11.2), but from the mean of the innovations, because their
squares show mainly the measurement noise.
"""

import math

DRIFT_TIME = 0.25
"""Time over which points must lie on one side to count as a drift [s]."""
CHANCE_DRIFT = 3.0
"""Square of a drift, in standard deviations, that is attributed to noise."""
DRIFT_SPEED_NOISE = 0.03
"""Process noise of the speed for each standard deviation of drift beyond that [m/s/sqrt(s)]."""
MAX_SPEED_NOISE = 0.2
"""Largest process noise of the speed, enough for a stop within half a second [m/s/sqrt(s)]."""


def update_drift(drift: float, lead: float, dt: float) -> float:
    """Returns the drift after a point: an average of leads, scaled to unit variance while the filter is right.

    Args:
        drift: drift before the point.
        lead: how far the point lies ahead of its expected position, in standard deviations.
        dt: time since the previous point [s].
    """
    kept = math.exp(-dt / DRIFT_TIME)
    return kept * drift + math.sqrt(1.0 - kept * kept) * lead


def adapted_speed_noise(drift: float, least: float) -> float:
    """Returns the process noise of the speed [m/s/sqrt(s)].

    Args:
        drift: the present drift.
        least: process noise of the speed without a drift [m/s/sqrt(s)].
    """
    beyond = max(drift**2 - CHANCE_DRIFT, 0.0)
    raised = math.sqrt(least**2 + DRIFT_SPEED_NOISE**2 * beyond)
    return max(min(raised, MAX_SPEED_NOISE), least)
