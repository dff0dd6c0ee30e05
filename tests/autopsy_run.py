"""A synthetic run with one deliberate fault: a train on a straight line, and one descent of the hand."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.arm.motion.transform_equation import share_done
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, Prediction, evaluate_prediction, pack_prediction
from drake_tracker.core.timing import SERVO_PERIOD, VISION_PERIOD
from drake_tracker.estimation import make_estimator
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.task import TASK
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, true_camera_models

SPEED, LAG = 0.1, 15 * VISION_PERIOD
START = np.array([0.56, -0.2, 0.485])
LAUNCH, END = 3.0, 4.5


def read(packet, time):
    """Returns the predicted pose (x, y, z, yaw) of the train, zeros before the first packet."""
    return evaluate_prediction(packet, time)[:4] if packet[4] else np.zeros(4)


@dataclass
class AutopsyRun:
    """The faults of a run.

    Attributes:
        noise: standard deviation of the noise of the left centroid [px].
        shift: of every point [m].
        lag: of the filtered state [s].
        slower: speed by which the train is predicted too slow, as a fraction of its speed.
        age: of the packet in force [s].
        beside: offset of the hand to the left of its target [m].
        early: time by which the closing is too early [s].
        slow: fraction of their speed that the jaws have lost.
        lifted: whether the train is lifted.
        attempts: whether the hand is sent down.
    """

    noise: float = 0.0
    shift: float = 0.0
    lag: float = 0.0
    slower: float = 0.0
    age: float = 0.0
    beside: float = 0.0
    early: float = 0.0
    slow: float = 0.0
    lifted: bool = False
    attempts: bool = True

    def scenario(self):
        scenario = TrainScenario(name="made-up", seed=1)
        return scenario.with_settings(
            {
                "track.kind": "line",
                "track.speed": SPEED,
                "track.direction": "forward",
                "track.centre_range": 0.0,
                "track.rotation_range_deg": 0.0,
            }
        )

    def log(self):
        scenario = self.scenario()
        grasp = scenario.grasp
        cycles = VISION_PERIOD * np.arange(round(END / VISION_PERIOD) + 1)
        ticks = SERVO_PERIOD * np.arange(round(END / SERVO_PERIOD) + 1)
        centroids, points = self._sight(scenario, cycles)
        packets = self._packets(points)
        phases, close = self._phases(ticks, grasp)

        # The log shows a packet one cycle after it was made; the servo has it at once.
        newest = np.clip(np.floor((ticks - self.age + 1e-9) / VISION_PERIOD).astype(int) + 1, 0, len(cycles) - 1)
        launched = np.searchsorted(ticks, LAUNCH)
        if self.attempts:
            newest[launched:] = newest[launched - 1]
        due = ticks + SERVO_PERIOD
        hand = np.array([read(packets[k], t) for k, t in zip(newest, due)])
        known = packets[newest, 4]
        target = (
            np.column_stack(
                [due, hand, np.zeros((len(ticks), 4)), packets[newest, :2], np.zeros((len(ticks), 2)), known]
            )
            * known[:, None]
        )

        held = np.minimum(np.floor((cycles + 1e-9) / SERVO_PERIOD).astype(int), len(ticks) - 1)
        tool = np.array([read(packets[newest[k]], t) for k, t in zip(held, cycles)])
        tool[:, 0] -= self.beside
        down = np.array([share_done((t - LAUNCH - 0.015) / grasp.descent_duration) for t in cycles])
        fall = grasp.grasp_height - grasp.hover_height
        tool[:, 2] += grasp.hover_height + (fall * down if self.attempts else 0.0)

        width = grasp.jaw_opening - (1.0 - self.slow) * grasp.jaw_speed * np.clip(cycles - close - 0.015, 0.0, None)
        width = np.maximum(width, grasp.object_width if self.lifted else 0.0)
        lifted = self.lifted & (cycles > close + 0.5)
        contact = self.lifted & (cycles > close + 0.135)
        verdict = np.zeros((len(cycles), len(TASK.signals()["truth_verdict"][1])))
        verdict[:, 0] = 0.15 * lifted
        verdict[:, 1] = verdict[:, 2] = contact
        verdict[:, 5] = lifted
        half = 0.25 * np.pi
        zero = np.zeros(len(cycles))
        velocity = np.column_stack([zero, zero, zero, zero, zero + SPEED, zero])  # angular, then translational
        train = np.column_stack([zero + np.cos(half), zero, zero, zero + np.sin(half), self._truth(cycles), velocity])
        status = np.zeros((len(ticks), 8))
        status[10:, 1] = known[:-10]  # the hand needs some time to reach the train
        command = np.column_stack([phases, np.zeros((len(ticks), 6))])
        attempts = (np.arange(len(ticks)) >= launched) * float(self.attempts)
        data = {
            **centroids,
            "point": (cycles, points),
            "filtered": (cycles, np.zeros((len(cycles), 7))),
            "prediction": (cycles, packets),
            "delivered": (cycles, packets.copy()),
            "target": (ticks, target),
            "command": (ticks, command),
            "status": (ticks, status),
            "diagnosis": (ticks, np.column_stack([phases, attempts, *np.zeros((4, len(ticks)))])),
            "q_commanded": (ticks, np.zeros((len(ticks), 6))),
            "arm_state": (cycles, np.zeros((len(cycles), 12))),
            "arm_effort": (cycles, np.zeros((len(cycles), 6))),
            "jaws": (cycles, np.column_stack([width, zero, zero])),
            "truth_train_state": (cycles, train),
            "truth_verdict": (cycles, verdict),
        }
        log = {name: Signal(times, rows, tuple(TASK.signals()[name][1])) for name, (times, rows) in data.items()}
        log["tool"] = Signal(cycles, tool, ("x", "y", "z", "yaw"))
        return log

    @staticmethod
    def _truth(times):
        return START + np.outer(times, [0.0, SPEED, 0.0])

    def _sight(self, scenario, cycles):
        """Returns the two centroids and the points, as logged."""
        cameras = true_camera_models(scenario.cameras)
        stamps = cycles - LAG - VISION_PERIOD
        there = (stamps >= 0.0).astype(float)
        rng = np.random.default_rng(5)
        pixels = {}
        for name in CAMERA_NAMES:
            pixels[name] = cameras[name].project(self._truth(stamps))
        pixels["camera_left"] = pixels["camera_left"] + self.noise * rng.standard_normal((len(cycles), 2))
        seen = [
            triangulate(*(cameras[name] for name in CAMERA_NAMES), *(pixels[name][k] for name in CAMERA_NAMES)).p_WQ
            for k in range(len(cycles))
        ]
        points = np.array(seen) - [self.shift, 0.0, 0.0]
        zero = np.zeros(len(cycles))
        centroids = {
            name.replace("camera", "centroid"): (
                cycles,
                np.column_stack([stamps, pixels[name], zero + 50.0, zero + 1.0]) * there[:, None],
            )
            for name in CAMERA_NAMES
        }
        return centroids, np.column_stack([stamps, points, zero, zero + 1.0]) * there[:, None]

    def _packets(self, points):
        """Returns the host's packets, one a cycle, as logged."""
        estimator = make_estimator("closed_path")
        state = estimator.initial_state()
        packets = [np.zeros(len(Prediction.get_fields()))]
        for stamp, x, y, z, _, valid in points:
            if valid:
                state = estimator.update(state, stamp, np.array([x, y, z]))
            if not valid or not estimator.ready(state):
                packets.append(packets[-1])
                continue
            times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([estimator.predict(state, times), np.zeros(KNOT_COUNT)])
            knots[:, 1] -= SPEED * (self.lag + self.slower * (times - stamp))
            packets.append(pack_prediction(stamp, len(packets), knots))
        return np.array(packets[:-1])

    def _phases(self, ticks, grasp):
        """Returns the phase at each tick, and the start of the closing [s]."""
        close = LAUNCH + grasp.descent_duration - grasp.closing_lead - self.early
        changes = [(Phase.ACQUIRE, 0.0), (Phase.TRACK, 1.02)]
        if self.attempts:
            after = Phase.LIFT if self.lifted else Phase.RETREAT
            changes += [(Phase.INTERCEPT, LAUNCH), (Phase.CLOSE, close), (after, close + 0.5)]
        starts = np.array([time for _, time in changes])
        return np.array([changes[k][0] for k in np.searchsorted(starts, ticks + 1e-9, side="right") - 1]), close
