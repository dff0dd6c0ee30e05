"""The task of Nashman and Chaconas 1990: catch a ball that rolls down a board of pegs, with one camera."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System

from drake_tracker.cameras.boards.board_poses import POSES_FILE, BoardPoses, load_poses, save_poses
from drake_tracker.core.messages import CatchDiagnosis, CatchVerdict
from drake_tracker.core.timing import BALL_SERVO_PERIOD, BALL_TIME_STEP, PROJECTOR_SLOT, vision_slot
from drake_tracker.diagrams.hand_eye import Controller, HandEyeDiagram
from drake_tracker.diagrams.parts import link_of
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.tasks.ball.diagram import (
    add_controller,
    ball_guard,
    ball_host,
    board_detector,
    board_projector,
    board_vision,
    build,
)
from drake_tracker.tasks.ball.filming import BALL_STRIPS, ball_film, ball_snapshot, ball_view
from drake_tracker.tasks.ball.initialisation import initialise_board
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.ball.setup import resolve
from drake_tracker.tasks.ball.summary import ROLLING, last_verdict, summarise_ball
from drake_tracker.tasks.episode import Log, phase_spans
from drake_tracker.tasks.filming import Film, Snapshot, View
from drake_tracker.tasks.task import AskForWindows, ReplayParts, Task, required

_ALWAYS_CHANGEABLE = ("estimator", "link", "guard", "servo")
_MM, _SECONDS, _PERCENT = (1e3, "mm", 1), (1.0, "s", 2), (100.0, "%", 1)


class BallFreeMotion:
    """The time in which the ball moves freely: from a tenth of a second after its release until it leaves the board.

    Args:
        scenario: the scenario of the run.
        log: {name: Signal} of the run.

    Attributes:
        spans: phases of the run.
    """

    def __init__(self, scenario: BallScenario, log: Log) -> None:
        self.spans = phase_spans(log, CatchPhase, scenario.time_step)
        verdict = last_verdict(log)
        self._start, self._end = np.inf, -np.inf
        if verdict.released:
            self._start, self._end = verdict.released + ROLLING, verdict.crossing_time or np.inf

    def free(self, times: np.ndarray) -> np.ndarray:
        return (times > self._start) & (times < self._end)

    tracked = observed = free


class BallTask(Task[BallScenario]):
    """The task of the ball."""

    name = "ball"
    phases = CatchPhase
    verdict = CatchVerdict
    diagnosis = CatchDiagnosis
    centroids = ("centroid",)
    truth_signal = "truth_ball_state"
    servo_period = BALL_SERVO_PERIOD
    time_step = BALL_TIME_STEP
    extra_signals = {}  # noqa: RUF012
    pictures = {  # noqa: RUF012
        "ball_path.png": "The board from above: path of the ball, predictions of it, the crossing and the cup.",
        "board.png": "The first image of the initialisation, with what was found in it.",
    }
    titles = ("The ball was not caught", "The ball was caught")
    outcomes = ("not caught", "caught")
    summary_rows = (
        ("hand_error_m", "offset of the cup from the ball", _MM),
        ("hold_s", "held for", _SECONDS),
        ("roll_s", "rolling time", _SECONDS),
        ("exit_speed_m_s", "exit speed", (1.0, "m/s", 2)),
        ("position_rms_m", "position error on the board, rms", _MM),
        ("vision_valid_fraction", "centroids that gave a point", _PERCENT),
    )
    result_rows = (
        ("success", "caught", ""),
        ("failure_reason", "reason", ""),
        ("hand_error_m", "hand error", "m"),
        ("hold_s", "held", "s"),
        ("position_rms_m", "position rms", "m"),
        ("board_in_camera_error", "board in camera", "m, rad"),
        ("board_in_world_error", "board in world", "m, rad"),
        ("real_time_factor", "real-time factor", ""),
    )
    changeable = {  # noqa: RUF012
        "points": _ALWAYS_CHANGEABLE,
        "centroids": (*_ALWAYS_CHANGEABLE, "vision.tolerance"),
        "images": (*_ALWAYS_CHANGEABLE, "vision"),
    }
    has_autopsy = False
    strips = BALL_STRIPS
    preparation = (
        "Initialisation: the camera measures the circles of the board, then the arm touches its marks (about 10 s)"
    )

    def uses_cameras(self, scenario: BallScenario) -> bool:
        return True

    def initialise(self, scenario: BallScenario, ask_for_windows: AskForWindows | None = None) -> BoardPoses:
        return initialise_board(scenario, ask_for_windows)

    def resolved(self, scenario: BallScenario, initialisation: BoardPoses) -> BallScenario:
        return scenario.with_settings({"operator.windows": initialisation.windows})

    def save_initialisation(self, initialisation: BoardPoses, folder: Path) -> None:
        save_poses(initialisation, folder / POSES_FILE)

    def build(self, scenario: BallScenario, initialisation: Any, decision: System | None = None) -> HandEyeDiagram:
        return build(resolve(scenario, required(initialisation, self.name)), decision)

    def add_controller(
        self, scenario: BallScenario, initialisation: Any, builder: DiagramBuilder, host: System | None = None
    ) -> Controller:
        return add_controller(resolve(scenario, required(initialisation, self.name)), builder, host=host)

    def ended(self, verdict: Any) -> str | None:
        if verdict.caught:
            return "the ball was caught"
        return "the ball is lost" if verdict.lost else None

    def summarise(
        self, scenario: BallScenario, hand_eye: HandEyeDiagram, log: Log, simulated: float, interrupted: bool
    ) -> dict[str, Any]:
        return summarise_ball(hand_eye, resolve(scenario, hand_eye.poses), log, simulated, interrupted)

    def free_motion(self, scenario: BallScenario, log: Log) -> BallFreeMotion:
        return BallFreeMotion(scenario, log)

    def draw(
        self, scenario: BallScenario, hand_eye: HandEyeDiagram, log: Log, summary: Mapping[str, Any], folder: Path
    ) -> None:
        from drake_tracker.tasks.ball.board_figure import draw_board_found  # Matplotlib is slow to load
        from drake_tracker.tasks.ball.path_figure import draw_ball_path

        setup = resolve(scenario, hand_eye.poses)
        draw_ball_path(hand_eye, setup, log, summary, folder / "ball_path.png")
        draw_board_found(setup, summary, folder / "board.png")

    def subtitle(self, scenario: BallScenario) -> str:
        return f"seed {scenario.seed}, board at {scenario.board.incline_deg:g}°"

    def film(self, scenario: BallScenario, hand_eye: HandEyeDiagram) -> Film:
        return ball_film(resolve(scenario, hand_eye.poses), hand_eye)

    def snapshot(self, scenario: BallScenario) -> Snapshot:
        return ball_snapshot(scenario.vision.detector)

    def view(self, scenario: BallScenario, hand_eye: HandEyeDiagram) -> View:
        return ball_view(resolve(scenario, hand_eye.poses))

    def success_sentence(self, summary: Mapping[str, Any]) -> str | None:
        details = []
        if summary.get("roll_s") is not None and summary.get("exit_speed_m_s") is not None:
            details.append(
                f"it left the board {summary['roll_s']:.2f} s after its release at {summary['exit_speed_m_s']:.2f} m/s"
            )
        if summary.get("hand_error_m") is not None:
            details.append(f"it passed {1e3 * abs(summary['hand_error_m']):.0f} mm from the middle of the cup")
        return f"The ball was caught{': ' if details else ''}{', and '.join(details)}."

    def signal_offset(self, name: str, time_step: float) -> float:
        if name == "point":
            return vision_slot(PROJECTOR_SLOT, time_step)
        return super().signal_offset(name, time_step)

    def rebuild(self, scenario: BallScenario, recorded: BallScenario, start: str, folder: Path) -> ReplayParts:
        vision: System | None = None
        images: dict[str, tuple[int, int]] = {}
        poses = load_poses(folder / POSES_FILE)
        setup = resolve(scenario, poses)
        if start == "images":
            window = resolve(recorded, poses).window
            vision = board_vision(setup, board_detector(setup, window), window)
            images = {"camera": window[2:]}
        elif start == "centroids":
            vision = board_projector(setup)
            vision.set_name("projector")
        return ReplayParts(vision, images, ball_host(setup), link_of(scenario, setup.faults), ball_guard(setup))


TASK = BallTask()
