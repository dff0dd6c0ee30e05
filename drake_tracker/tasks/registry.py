"""The tasks: what the run of a train and the run of a ball do each in their own way, for `simulation.simulate`."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import EnumMeta

from drake_tracker.core.errors import DrakeTrackerError


@dataclass(frozen=True)
class Task:
    """What tells one task from another.

    make_diagram: (scenario, mark_windows or None) -> `HandEyeDiagram`; see `initialise_board`, others need no such.
    phases: the IntEnum of `ArmCommand`'s phase. verdict: the named view of the judge's findings. ended: such a view ->
    why the run is over, None while it is not. needs_renderer: scenario -> whether images are rendered. keep:
    (hand_eye, out) leaves what was found before the run. add_video: (builder, hand_eye, scenario, path, onlooker) and
    add_snapshot: (builder, hand_eye, scenario, path) -> recorders of images, each with ``finish(context)``. view:
    (hand_eye, scenario) -> `View` of the Meshcat recording. summarize:
    (hand_eye, scenario, log, simulated, interrupted) -> dict. draw: (hand_eye, scenario, log, summary, out) leaves the
    pictures of a run.
    """

    make_diagram: Callable
    phases: EnumMeta
    verdict: type
    ended: Callable
    needs_renderer: Callable
    keep: Callable
    add_video: Callable
    add_snapshot: Callable
    view: Callable
    summarize: Callable
    draw: Callable


def task_of(scenario):
    """Returns the `Task` of a scenario. Raises DrakeTrackerError when there is none of its name."""
    if scenario.task not in _TASKS:
        raise DrakeTrackerError(f"task is {scenario.task!r}; there are {', '.join(_TASKS)}")
    return _TASKS[scenario.task]()


def make_diagram(scenario):
    """Returns the `HandEyeDiagram` of a scenario of any task; see `diagrams/train.py` and `diagrams/ball.py`."""
    return task_of(scenario).make_diagram(scenario, None)


def has_images(hand_eye):
    """Whether a `HandEyeDiagram` looks at images: not with measured vision, nor if another process does."""
    return hand_eye.HasOutputPort("motion_left") or hand_eye.HasOutputPort("motion")


def _train():
    from drake_tracker.core.messages import Verdict
    from drake_tracker.grasp.schema import Phase
    from drake_tracker.run.scene import TRAIN_VIEW
    from drake_tracker.tasks.train.diagram import make_diagram
    from drake_tracker.tasks.train.figures import draw_tracking
    from drake_tracker.tasks.train.scenario import Measured
    from drake_tracker.tasks.train.summary import summarize

    def ended(verdict):
        if verdict.taken:
            return "the train was taken"
        return "the train was thrown off its track" if verdict.derailed else None

    def add_video(*arguments):
        from drake_tracker.run.camera_video import add_camera_video

        return add_camera_video(*arguments)

    def add_snapshot(builder, hand_eye, scenario, path):
        from drake_tracker.run.motion_snapshot import add_motion_snapshot

        return add_motion_snapshot(builder, hand_eye, path)

    return Task(
        make_diagram=lambda scenario, mark_windows: make_diagram(scenario),
        phases=Phase,
        verdict=Verdict,
        ended=ended,
        needs_renderer=lambda scenario: not isinstance(scenario.vision, Measured),
        keep=lambda hand_eye, out: None,
        add_video=add_video,
        add_snapshot=add_snapshot,
        view=lambda hand_eye, scenario: TRAIN_VIEW,
        summarize=lambda hand_eye, *rest: summarize(*rest),
        draw=lambda hand_eye, scenario, log, summary, out: draw_tracking(scenario, log, summary, out / "tracking.png"),
    )


def _ball():
    from drake_tracker.core.messages import CatchVerdict
    from drake_tracker.grasp.catch_schema import CatchPhase
    from drake_tracker.tasks.ball.board_figure import draw_board_found
    from drake_tracker.tasks.ball.diagram import make_diagram
    from drake_tracker.tasks.ball.initialisation import initialise_board
    from drake_tracker.tasks.ball.path_figure import draw_ball_path
    from drake_tracker.tasks.ball.summary import summarize_ball
    from drake_tracker.vision.board_poses import POSES_FILE, save_poses

    def ended(verdict):
        if verdict.caught:
            return "the ball was caught"
        return "the ball is lost" if verdict.lost else None

    def add_video(*arguments):
        from drake_tracker.tasks.ball.video import add_ball_video

        return add_ball_video(*arguments)

    def add_snapshot(*arguments):
        from drake_tracker.tasks.ball.video import add_ball_snapshot

        return add_ball_snapshot(*arguments)

    def view(hand_eye, scenario):
        from drake_tracker.tasks.ball.video import ball_view

        return ball_view(hand_eye, scenario)

    def draw(hand_eye, scenario, log, summary, out):
        draw_ball_path(hand_eye, scenario, log, summary, out / "ball_path.png")
        draw_board_found(hand_eye, scenario, summary, out / "board.png")

    return Task(
        make_diagram=lambda scenario, mark_windows: make_diagram(scenario, initialise_board(scenario, mark_windows)),
        phases=CatchPhase,
        verdict=CatchVerdict,
        ended=ended,
        needs_renderer=lambda scenario: True,
        keep=lambda hand_eye, out: save_poses(hand_eye.poses, out / POSES_FILE),
        add_video=add_video,
        add_snapshot=add_snapshot,
        view=view,
        summarize=summarize_ball,
        draw=draw,
    )


_TASKS = {"train": _train, "ball": _ball}
