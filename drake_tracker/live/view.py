"""The live view of a run: connects the run with the page, its content and its requests.

Drake is imported when the diagram is watched, so that the page is up within a moment.
"""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from enum import IntEnum
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from drake_tracker.grasp.operator_override import OperatorMode
from drake_tracker.live.control import RATES, Control
from drake_tracker.live.operator import OperatorPanel
from drake_tracker.live.server import Server
from drake_tracker.live.state import LiveState
from drake_tracker.live.windows import WindowQuestion

if TYPE_CHECKING:
    from pydrake.systems.framework import DiagramBuilder, OutputPort

    from drake_tracker.diagrams.hand_eye import HandEyeDiagram

_RELOAD_TIME = 2.0
"""Time [s] after which a page without a connection counts as closed; reloading it takes less."""
_FAREWELL = 1.0
"""Longest time [s] that open pages have to fetch the outcome of the run."""
_SETTLED = 0.5
"""Wall time [s] after which the real-time factor is shown."""


class LiveView:
    """The page of a run, from its preparation to its end: a context manager, used by the simulation's thread.

    Attributes:
        url: address of the page.
        state: what the page shows.
        control: how the page holds the run.
        operator: what the operator at the page wants of the arm.
        frames: sink of the camera video's frames.
    """

    def __init__(
        self,
        port: int = 0,
        say: Callable[[str], object] = lambda line: print(line, file=sys.stderr),
    ) -> None:
        """Starts the server of the page.

        Args:
            port: port to listen at; 0 takes a free one. Raises DrakeTrackerError when the port is taken.
            say: prints a line.
        """
        self.state, self.control, self.operator = LiveState(), Control(), OperatorPanel()
        self._say = say
        self._question: WindowQuestion | None = None
        self._left_at: float | None = None
        self._start = 0.0
        self._overview: dict[str, Any] = {}
        self._server = Server(self.state, self._act, self._picture, port)
        self.url = self._server.url
        self.frames = self.state.frames

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is not None:
            reason = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__
            self.finish({"success": False, "title": "The run was aborted", "reason": reason})
        self.state.close()
        until = time.monotonic() + _FAREWELL
        while self.state.watchers and time.monotonic() < until:
            time.sleep(0.02)
        self._server.close()

    def introduce(self, scenario: Any) -> None:
        """Shows on the page which scenario is run."""
        from drake_tracker.tasks.registry import task_of

        self.state.set_facts(
            title=scenario.name,
            subtitle=task_of(scenario).subtitle(scenario),
            duration=scenario.duration,
            rates=RATES,
        )

    def mark_windows(self, images: Sequence[np.ndarray], operator: Any) -> list[list[float]]:
        """Asks the person at the page for windows around the circles of the board, see `initialise_board`.

        Args:
            images: RGB uint8, shape (h, w, 3), of the same scene.
            operator: `OperatorConfig` with the threshold.

        Returns the windows (u0, v0, width, height) [px], or an empty list to have the circles found automatically.
        """
        from drake_tracker.world.ball.ball_board import CIRCLES

        self._question = question = WindowQuestion(images, operator.threshold, len(CIRCLES))
        self.state.set_facts(stage="windows", image_size=question.size, circles=len(CIRCLES))
        self._say(f"The live view waits for a window around each of the {len(CIRCLES)} circles: {self.url}")
        windows = question.wait(self._notice_closed_page)
        self.state.set_facts(stage="preparing")
        self._question = None
        return windows

    def listen(self, builder: "DiagramBuilder", hand_eye: "HandEyeDiagram") -> "OutputPort | None":
        """Connects the operator at the page to the arm.

        Args:
            builder: has ``hand_eye`` and receives the `OperatorSystem`.
            hand_eye: diagram of the scenario.

        Returns the port with the operator's commands, to be logged, or None when the arm listens to no operator.
        """
        from drake_tracker.live.operator_system import add_operator

        port = add_operator(builder, hand_eye=hand_eye, panel=self.operator)
        self.state.set_facts(operator=port is not None)
        return port

    def watch(
        self,
        builder: "DiagramBuilder",
        hand_eye: "HandEyeDiagram",
        scenario: Any,
        phases: type[IntEnum],
        scene_url: str,
    ) -> None:
        """Adds the Systems behind the page, except for the images, to the diagram of a run, and describes the run to
        the page.

        Args:
            builder: has ``hand_eye`` and receives the `StripsSystem` and, where the task has one, the `OverviewSystem`.
            hand_eye: diagram of the scenario.
            scenario: the scenario.
            phases: enumeration of the task's phases.
            scene_url: address of the 3-D scene.
        """
        from drake_tracker.arm.arm_model import make_arm_model
        from drake_tracker.diagrams.hand_eye import has_images
        from drake_tracker.diagrams.parts import arm_of
        from drake_tracker.live.overview_system import add_overview
        from drake_tracker.live.strips_system import add_strips
        from drake_tracker.tasks.registry import task_of
        from drake_tracker.tasks.style import phase_colour

        chart, overview = task_of(scenario).strips, task_of(scenario).overview
        model = make_arm_model(arm_of(scenario))
        add_strips(builder, hand_eye=hand_eye, chart=chart, model=model, add_sample=self.state.add_sample)
        if overview is not None:
            add_overview(builder, hand_eye=hand_eye, overview=overview, model=model, show=self._show_overview)
            self.state.set_facts(overview=overview.facts(scenario, hand_eye))
        self.state.set_facts(
            scene=scene_url,
            cameras=has_images(hand_eye),
            phases=[{"name": phase.name.capitalize(), "colour": phase_colour(phase)} for phase in phases],
            strips=[asdict(strip) for strip in chart.strips],
            span=chart.span,
        )

    def _show_overview(self, values: dict[str, Any]) -> None:
        self._overview = {"overview": values}

    def begin(self) -> None:
        """Shows on the page that the simulation begins."""
        self._start = time.monotonic()
        self.state.set_facts(stage="running")

    def look(self, now: float, phase: int, p_success: float | None, interrupted: Callable[[], bool]) -> None:
        """Updates the page, and holds the run while the page requests it.

        Args:
            now: simulated time [s].
            phase: number of the phase.
            p_success: probability that a grasp would succeed, None while the task does not estimate it.
            interrupted: returns whether the run was interrupted; then it is not held.
        """
        running = time.monotonic() - self._start - self.control.held
        factor = round(now / running, 2) if running > _SETTLED else None

        def update() -> None:
            paused, rate = self.control.paused, self.control.rate
            operator = self.operator.mode.name.lower()
            tracks, reason = self._tracks()
            self.state.set_values(
                time=round(now, 4),
                phase=phase,
                p_success=None if p_success is None else round(p_success, 3),
                factor=factor,
                paused=paused,
                rate=rate,
                operator=operator,
                tracks=tracks,
                reason=reason,
                **self._overview,
            )
            self._notice_closed_page(paused)

        update()
        self.control.hold(now, interrupted, update)

    def _tracks(self) -> tuple[list[dict[str, Any]], str]:
        """Returns the tracks to list on the page, see `Frames.tracks`."""
        return self.frames.tracks() if self.frames.several else ([], "")

    def write(self) -> None:
        """Shows on the page that the simulation is over and its results are being written."""
        self.state.set_facts(stage="writing")

    def finish(self, outcome: dict[str, Any]) -> None:
        """Shows the outcome of the run on the page.

        Args:
            outcome: {"success", "title", "reason", "rows", "out"}: whether the task succeeded, texts, list of (label,
                text), the run directory.
        """
        self.state.set_facts(stage="over", outcome=outcome)

    def _notice_closed_page(self, paused: bool = False) -> None:
        """Prints, once, that the last page was closed."""
        if not self.state.left:
            self._left_at = None
        elif self._left_at is None:
            self._left_at = time.monotonic()
        elif time.monotonic() > self._left_at + _RELOAD_TIME:
            self.state.left, self._left_at = False, None
            if paused:
                self._say(f"The live view was closed. The run is paused; open {self.url} to resume it")
            elif self.operator.mode != OperatorMode.SUPERVISE:
                self._say(f"The live view was closed. The arm waits for the operator; open {self.url} to release it")
            else:
                self._say(f"The live view was closed. The run continues; watch it again at {self.url}")

    def _act(self, action: Any, values: dict[str, Any]) -> dict[str, Any]:
        """Carries out a request of the page; see `Server`."""
        if action in ("pause", "resume", "step") and not values:
            getattr(self.control, action)()
        elif action == "rate" and set(values) == {"rate"}:
            self.control.set_rate(values["rate"])
        elif action == "operator" and set(values) == {"mode"}:
            self.operator.set_mode(values["mode"])
        elif action == "jog" and set(values) == {"axis", "sign"}:
            self.operator.jog(values["axis"], values["sign"])
        elif action == "select" and set(values) == {"number"}:
            self.operator.select(values["number"], [track["number"] for track in self.frames.tracks()[0]])
        elif action in ("read", "mark"):
            return self._answer_question(action, values)
        else:
            raise ValueError("there is no such action")
        operator = self.operator.mode.name.lower()
        return {"paused": self.control.paused, "rate": self.control.rate, "operator": operator}

    def _answer_question(self, action: str, values: dict[str, Any]) -> dict[str, Any]:
        question = self._question
        if question is None:
            raise ValueError("there is no question about windows")
        try:
            if action == "mark":
                question.answer(values.get("windows"))
                return {}
            reading, window = question.read(values.get("window"))
        except ValueError as problem:  # the person's mistake, not the page's
            return {"problem": str(problem)}
        return {"window": window, **{key: round(value, 2) for key, value in reading._asdict().items()}}

    def _picture(self, route: str) -> bytes | None:
        if route == "/frame.jpg":
            return self.frames.jpeg()
        question = self._question  # a local name, because the simulation's thread may reset it meanwhile
        return question.png if question else None
