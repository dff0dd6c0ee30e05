"""What the tests of the catch share: parameters, a board, packets of a ball that rolls down it."""

from bisect import bisect

import numpy as np
from slopes import LAG, RADIUS, board_pose, to_world

from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    ArmCommand,
    OperatorCommand,
    Prediction,
    ServoTarget,
    ToolStatus,
    message_size,
    pack_prediction,
)
from drake_tracker.grasp.ball.board_exit import BoardEdge
from drake_tracker.grasp.ball.catch_machine import CatchObservation

TIME_STEP, PERIOD = 1.0 / 600.0, 0.005
X_WB = board_pose()
NOBODY = OperatorCommand(np.zeros(message_size(OperatorCommand)))
"""An operator who only supervises."""
ACCELERATION = 0.6 * 9.81 * np.sin(np.deg2rad(10.0))


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


def play(machine, packets, duration):
    """Runs a `CatchMachine` with a hand that is always where it is commanded to be.

    Args:
      packets: a function of the time [s] that returns the newest `Prediction` vector.

    Returns (rows of time, phase, tool x, y, z; the machine's last state).
    """
    motion = ToolMotion(machine.edge.home, PERIOD, moving=False, symmetric=False)
    home = machine.edge.home
    hand = motion.initial_state(home[:3] + [0.0, 0.0, machine.config.rim_height], home[3])
    state, rows = machine.initial_state(), []
    for k in range(round(duration / PERIOD)):
        time, packet = k * PERIOD, packets(k * PERIOD)
        target = ServoTarget(np.append(np.zeros(13), Prediction(packet).valid))
        status = ToolStatus(np.array([hand.motion, hand.fraction, 0.0, *hand.tool[:4], hand.branch]))
        state = machine.update(state, CatchObservation(time, target, packet, status, NOBODY))
        goal = ServoTarget(machine.goal_target(state))
        hand = motion.update(hand, time, ArmCommand(machine.command(state)), goal, 0.0)
        rows.append((time, state.phase, *hand.tool[:3]))
    return np.array(rows), state


def packets_of(estimator, stamps, p_WQ):
    """Returns the function of time for `play`: what an estimator makes of points, known `LAG` after their stamps."""
    state, known, packets = estimator.initial_state(), [-np.inf], [np.zeros(message_size(Prediction))]
    for k, (stamp, point) in enumerate(zip(stamps, p_WQ)):
        state = estimator.update(state, stamp, point)
        if estimator.ready(state):
            times = state.stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([estimator.predict(state, times), estimator.predict_std(state, times)])
            known.append(stamp + LAG)
            packets.append(pack_prediction(state.stamp, k + 1, knots))
    return lambda time: packets[bisect(known, time) - 1]
