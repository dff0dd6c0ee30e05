"""The live view of one run: the page's server, what it shows, and what it asks for."""

import sys
import time

from drake_tracker.live.control import RATES, Control
from drake_tracker.live.server import Server
from drake_tracker.live.state import LiveState

_RELOAD = 2.0
"""Time [s] after which a page that is not there was closed, and not just loaded again."""
_LAST_WORDS = 1.0
"""Longest time [s] that open pages have to fetch how the run ended."""
_SETTLED = 0.5
"""Time [s] from which on a real-time factor is told."""


class LiveView:
    """The page of a run, from its preparation to its end: a context manager, to be used by the simulation's thread.

    Args:
      port: to listen at; 0 takes a free one. say: prints a line.

    Raises DrakeTrackerError when the port is taken.
    """

    def __init__(self, port=0, say=lambda line: print(line, file=sys.stderr)):
        self.state, self.control = LiveState(), Control()
        self._say, self._question, self._left_at = say, None, None
        self._start = None
        self._server = Server(self.state, self._act, self._picture, port)
        self.url = self._server.url
        self.frames = self.state.frames

    def __enter__(self):
        return self

    def __exit__(self, kind, error, traceback):
        if error is not None:
            reason = "interrupted" if kind is KeyboardInterrupt else str(error) or kind.__name__
            self.finish({"success": False, "title": "The run broke off", "reason": reason})
        self.state.close()
        until = time.monotonic() + _LAST_WORDS
        while self.state.watchers and time.monotonic() < until:
            time.sleep(0.02)
        self._server.close()

    def introduce(self, scenario):
        """Tells the page which run this is."""
        words = [f"seed {scenario.seed}"]
        words.append(
            f"{scenario.track.speed:g} m/s" if scenario.task == "train" else f"board at {scenario.board.incline_deg:g}°"
        )
        self.state.set_facts(
            title=scenario.name, subtitle=", ".join(words), task=scenario.task, duration=scenario.duration, rates=RATES
        )

    def mark_windows(self, images, operator):
        """Asks the person at the page for windows around the board's circles; see `initialise_board`."""
        from drake_tracker.live.windows import WindowQuestion
        from drake_tracker.world.ball_board import CIRCLES

        self._question = question = WindowQuestion(images, operator.threshold, len(CIRCLES))
        self.state.set_facts(stage="windows", image_size=question.size, circles=len(CIRCLES))
        self._say(f"The live view waits for a window around each of the {len(CIRCLES)} circles: {self.url}")
        windows = question.wait(self._notice)
        self.state.set_facts(stage="preparing")
        self._question = None
        return windows

    def watch(self, builder, hand_eye, scenario, phases, scene_url):
        """Adds the strips to the diagram, and tells the page what is to be seen. ``phases``: the task's IntEnum."""
        from drake_tracker.arm.description import make_arm_model
        from drake_tracker.diagrams.arms import arm_of
        from drake_tracker.live.strips import SPANS, STRIPS
        from drake_tracker.live.strips_system import add_strips
        from drake_tracker.tasks.registry import has_images
        from drake_tracker.tasks.style import phase_colour

        add_strips(builder, hand_eye, scenario.task, make_arm_model(arm_of(scenario)), self.state.add_sample)
        self.state.set_facts(
            scene=scene_url,
            cameras=has_images(hand_eye),
            phases=[{"name": phase.name.capitalize(), "colour": phase_colour(phase)} for phase in phases],
            strips=[vars(strip) for strip in STRIPS[scenario.task]],
            span=SPANS[scenario.task],
        )

    def begin(self):
        """Tells the page that the simulation begins."""
        self._start = time.monotonic()
        self.state.set_facts(stage="running")

    def look(self, now, phase, interrupted):
        """Tells the page the simulated time ``now`` [s] and the phase's number, and holds the run while the page asks
        for it and it is not ``interrupted``, a function.
        """
        running = time.monotonic() - self._start - self.control.held
        factor = round(now / running, 2) if running > _SETTLED else None

        def tell():
            paused, rate = self.control.paused, self.control.rate
            self.state.tell(time=round(now, 4), phase=phase, factor=factor, paused=paused, rate=rate)
            self._notice(paused)

        tell()
        self.control.hold(now, interrupted, tell)

    def write(self):
        """Tells the page that the simulation is over and its results are being written."""
        self.state.set_facts(stage="writing")

    def finish(self, outcome):
        """Tells the page how the run ended: {"success", "title", "reason", "rows", "out"}."""
        self.state.set_facts(stage="over", outcome=outcome)

    def _notice(self, paused=False):
        """Says, once, that the last page was closed."""
        if not self.state.left:
            self._left_at = None
        elif self._left_at is None:
            self._left_at = time.monotonic()
        elif time.monotonic() > self._left_at + _RELOAD:
            self.state.left, self._left_at = False, None
            goes_on = "the run is paused until you open" if paused else "the run goes on; watch it again at"
            self._say(f"The live view was closed: {goes_on} {self.url}")

    def _act(self, action, values):
        """Does what the page asks for; see `Server`."""
        if action in ("pause", "resume", "step") and not values:
            getattr(self.control, action)()
        elif action == "rate" and set(values) == {"rate"}:
            self.control.set_rate(values["rate"])
        elif action in ("read", "mark"):
            return self._ask(action, values)
        else:
            raise ValueError("there is no such action")
        return {"paused": self.control.paused, "rate": self.control.rate}

    def _ask(self, action, values):
        question = self._question
        if question is None:
            raise ValueError("no windows are asked for")
        try:
            if action == "mark":
                question.answer(values.get("windows"))
                return {}
            reading, window = question.read(values.get("window"))
        except ValueError as problem:  # of the person's, not of the page's
            return {"problem": str(problem)}
        return {"window": window, **{key: round(value, 2) for key, value in reading._asdict().items()}}

    def _picture(self, route):
        if route == "/frame.jpg":
            return self.frames.jpeg()
        question = self._question  # which the simulation's thread may take away meanwhile
        return question.png if question else None
