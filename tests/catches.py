"""What the tests of the catch share: parameters, a board, packets of a ball that rolls down it."""

from types import SimpleNamespace

import numpy as np
from slopes import RADIUS, board_pose, to_world

from drake_tracker.arm.crossing import BoardEdge
from drake_tracker.messages import KNOT_COUNT, KNOT_SPACING, pack_prediction

TIME_STEP, PERIOD = 1.0 / 600.0, 0.005
X_WB = board_pose()
ACCELERATION = 0.6 * 9.81 * np.sin(np.deg2rad(10.0))


def catch_parameters(**changes):
    values = dict(
        rim_height=-0.035,
        raised_height=0.085,
        home_duration=1.0,
        raise_duration=0.6,
        stop_duration=0.2,
        shortest_motion=0.15,
        hand_speed=0.8,
        manual_speed=0.25,
        follow_tolerance=0.002,
        settle_time=0.12,
        settle_tolerance=0.015,
        rest_time=0.4,
        trust_time=0.45,
        ready_after=0.3,
    )
    return SimpleNamespace(**{**values, **changes})


def edge(**changes):
    return BoardEdge(X_WB, **changes)


def ball_packet(stamp, arrival, x, vx=0.0, speed=1.0, seq=1):
    """A packet of a ball that crosses the edge at ``arrival`` [s] at x [m, B], with the given speeds [m/s] there."""
    t = stamp + KNOT_SPACING * np.arange(KNOT_COUNT) - arrival
    y = -speed * t - 0.5 * ACCELERATION * t**2
    rows = to_world(np.column_stack([x + vx * t, y]), X_WB)
    v_WQ = X_WB[:3, :3] @ [vx, -speed, 0.0]
    fall = np.maximum(t, 0.0)[:, None]
    free = to_world(np.array([[x, 0.0]]), X_WB) + v_WQ * fall - [0.0, 0.0, 0.5 * 9.81] * fall**2
    rows = np.where(t[:, None] > 0.0, free, rows)
    return pack_prediction(stamp, seq, np.column_stack([rows, np.full(KNOT_COUNT, np.pi), np.full(KNOT_COUNT, 0.004)]))


def on_edge(x):
    """p_WQ of a ball's centre on the edge."""
    return X_WB[:3, 3] + X_WB[:3, :3] @ [x, 0.0, RADIUS]
