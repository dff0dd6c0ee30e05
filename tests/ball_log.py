"""A synthetic run of the ball, without simulation: the ball rolls straight down, with known errors."""

from types import SimpleNamespace

import numpy as np
from catches import ACCELERATION, X_WB, ball_packet
from pydrake.math import RigidTransform

from drake_tracker.cameras.boards.board_poses import BoardPoses
from drake_tracker.cameras.boards.circle_pose import image_centres
from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.ball.task import TASK
from drake_tracker.world.ball.ball_board import BALL_RADIUS, CIRCLE_RADIUS, CIRCLES, TOUCH_MARKS
from drake_tracker.world.ball.ball_camera import draw_camera_pose
from drake_tracker.world.imaging.cameras import lens_matrix

LAG = 5 * VISION_PERIOD
EXIT_SPEED = 1.0
ROLL = EXIT_SPEED / ACCELERATION


class BallRun:
    """Makes the scenario, the log and a substitute for the hand-eye diagram of a run.

    Attributes:
        duration: length of the run [s].
        released: time of the release [s], None for a ball that is never released.
        x: x_B of the ball's path [m].
        point_offset: offset of the measured points across the board [m].
        crossing_offset: offset of the predicted crossing across the board [m].
        hand: offset of the cup from the ball across the board [m].
        caught: whether the ball is caught.
    """

    def __init__(self):
        self.scenario = BallScenario(name="rolling", seed=4)
        self.duration, self.released, self.x = 4.0, 1.0, 0.10
        self.point_offset, self.crossing_offset, self.hand, self.caught = 0.0, 0.0, 0.0, True
        self.X_WB = RigidTransform(X_WB)
        X_WC = draw_camera_pose(
            self.scenario.camera, board=self.scenario.board, X_WB=self.X_WB, seed=self.scenario.seed
        )
        X_CB = X_WC.inverse() @ self.X_WB
        p_BQ = np.column_stack([CIRCLES, np.zeros(4)])
        circles = image_centres(X_CB.GetAsMatrix4(), p_BQ, lens_matrix(self.scenario.camera), CIRCLE_RADIUS)
        marks = self.X_WB.multiply(np.column_stack([TOUCH_MARKS, np.full(3, 0.004)]).T).T
        image = np.full((256, 256, 3), 200, np.uint8)
        laboratory = SimpleNamespace(X_WB=self.X_WB, pegs=np.array([(0.0, 0.4), (0.1, 0.6)]))
        self.hand_eye = SimpleNamespace(
            poses=BoardPoses(X_CB, RigidTransform(self.X_WB), 0.02, marks, image, circles),
            world=SimpleNamespace(laboratory=laboratory, cameras={"camera": SimpleNamespace(X_WC=X_WC)}),
        )

    @property
    def crossing(self):
        return self.released + ROLL if self.released else None

    def in_world(self, x, y):
        """p_WQ (n, 3) of the ball's centre at (x, y)_B."""
        return self.X_WB.multiply(np.column_stack([x, y, np.full(len(y), BALL_RADIUS)]).T).T

    def ball(self, times):
        """True p_WQ (n, 3) at ``times`` [s]: at rest, rolling, then at rest in the cup, 5 cm beyond the edge."""
        left = np.clip(self.crossing - times, 0.0, ROLL) if self.released else np.full(len(times), ROLL)
        y = EXIT_SPEED * left - 0.5 * ACCELERATION * left**2
        if self.released:
            y = np.where(times > self.crossing, np.maximum(-EXIT_SPEED * (times - self.crossing), -0.05), y)
        return self.in_world(np.full(len(y), self.x), y)

    def log(self):
        cycles = VISION_PERIOD * np.arange(round(self.duration / VISION_PERIOD) + 1)
        data = {name: np.zeros((len(cycles), len(names))) for name, (_, names) in TASK.signals().items()}

        def put(name, **fields):
            names = TASK.signals()[name][1]
            for field, values in fields.items():
                data[name][:, names.index(field)] = values

        def xyz(p_WQ):
            return dict(zip("xyz", p_WQ.T))

        stamps = np.floor((cycles - LAG) / (4 * VISION_PERIOD)) * 4 * VISION_PERIOD  # a new one every fourth cycle
        rolls = np.zeros(len(cycles), bool)
        put("truth_ball_state", qw=1.0, **xyz(self.ball(cycles)))
        if self.released:
            rolls = (stamps > self.released + 0.1) & (stamps < self.crossing - 0.1)
            seen = self.ball(stamps) + self.point_offset * self.X_WB.rotation().matrix()[:, 0]
            put("point", valid=rolls, **xyz(seen))
            put("filtered", stamp=stamps, valid=rolls, **xyz(seen))
            for name in ("prediction", "delivered"):
                for k in np.flatnonzero(rolls):
                    seq = 1 + round(60 * stamps[k])
                    data[name][k] = ball_packet(stamps[k], self.crossing, self.x + self.crossing_offset, seq=seq)
            put("diagnosis", known=cycles > self.released + 0.2)
            place = self.in_world(np.full(len(cycles), self.x + self.crossing_offset), np.full(len(cycles), -0.05))
            put("diagnosis", x=place[:, 0], y=place[:, 1])
            over = cycles >= self.crossing
            put("truth_verdict", released=np.where(cycles >= self.released, self.released, 0.0))
            put("truth_verdict", crossing_x=over * self.x, crossing_time=over * self.crossing)
            held = np.clip(cycles - self.crossing - 0.1, 0.0, None) if self.caught else 0.0
            put("truth_verdict", held=held, in_cup=held > 0.0, caught=held >= 1.0)
        put("point", stamp=np.maximum(stamps, 0.0))
        end = self.crossing or self.duration
        starts = [0.0, (self.released or end) + 0.2, end - 0.1, end, end + 0.4, end + 1.0]
        phase = np.searchsorted(starts, cycles, side="right") - 1 if self.released else np.zeros(len(cycles))
        put("command", phase=phase)
        put("diagnosis", phase=phase)
        log = {name: Signal(cycles, rows, tuple(TASK.signals()[name][1])) for name, rows in data.items()}
        hand = self.x + self.hand if self.released else 0.0
        tool = self.in_world(np.where(phase > CatchPhase.WAIT, hand, 0.0), np.full(len(cycles), -0.05))
        log["tool"] = Signal(cycles, np.column_stack([tool, np.full(len(cycles), np.pi)]), ("x", "y", "z", "yaw"))
        return log


def nothing_logged():
    """The log of a run that was over before anything was logged."""
    none = np.zeros(0)
    log = {name: Signal(none, np.zeros((0, len(names))), tuple(names)) for name, (_, names) in TASK.signals().items()}
    log["tool"] = Signal(none, np.zeros((0, 4)), ("x", "y", "z", "yaw"))
    return log
