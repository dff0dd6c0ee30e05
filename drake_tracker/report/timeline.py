"""The phases of a run as a picture: a bar of colours over time, with a mark for each attempt.

Lengths are in units of the picture's view box.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, ClassVar

from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.style import INK, SOFT_INK, phase_colour

_MARKS = {"lifted": "#009e73", "missed": "#d55e00", "dropped": "#cc79a7"}
_GREY = "#8a9099"


@dataclass(frozen=True)
class Text:
    """A text in the picture.

    Attributes:
        x: position.
        y: of the baseline.
        words: the text.
        colour: "#rrggbb".
        size: of the type.
        anchor: "start", "middle" or "end": what of the text is at ``x``.
        bold: whether the type is bold.
    """

    x: float
    y: float
    words: str
    colour: str
    size: int
    anchor: str
    bold: bool = False


@dataclass(frozen=True)
class Block:
    """The part of the bar that shows one phase.

    Attributes:
        x: left end.
        width: of the block.
        colour: "#rrggbb".
        hint: name and times of the phase.
    """

    x: float
    width: float
    colour: str
    hint: str


@dataclass(frozen=True)
class Mark:
    """The mark of an attempt, above the bar.

    Attributes:
        x: of its tip.
        colour: "#rrggbb".
        hint: sentence on the attempt.
    """

    x: float
    colour: str
    hint: str


@dataclass(frozen=True)
class RunTimeline:
    """The picture.

    Attributes:
        top: upper edge of the view box.
        blocks: phases.
        ticks: positions of the ticks below the bar.
        marks: attempts.
        texts: all texts.
        legend: (colour, name, total time [s]) of each phase that occurred.
    """

    WIDTH: ClassVar[int] = 1160
    HEIGHT: ClassVar[int] = 92
    BAR_TOP: ClassVar[int] = 34
    BAR_HEIGHT: ClassVar[int] = 30
    GREY: ClassVar[str] = _GREY

    top: float
    blocks: tuple[Block, ...]
    ticks: tuple[float, ...]
    marks: tuple[Mark, ...]
    texts: tuple[Text, ...]
    legend: tuple[tuple[str, str, float], ...]


def make_timeline(spans: Sequence[PhaseSpan], attempts: Sequence[Mapping[str, Any]] = ()) -> RunTimeline:
    """Returns the picture of the phases, with a mark where the jaws of each attempt began to close.

    Args:
        spans: phases of the run, at least one.
        attempts: dicts of `diagnosis.perform`. An attempt whose jaws never closed is marked at its launch.
    """
    end = max(spans[-1].end, 1e-3)
    scale = RunTimeline.WIDTH / end
    texts: list[Text] = []
    blocks = []
    for span in spans:
        x, width = scale * span.start, max(scale * span.end - scale * span.start, 0.5)
        name = span.phase.name.lower()
        blocks.append(Block(x, width, phase_colour(span.phase), f"{name}, {span.start:.2f} to {span.end:.2f} s"))
        if width > 9.0 * len(name):
            texts.append(Text(x + 0.5 * width, RunTimeline.BAR_TOP + 20, name, "#ffffff", 13, "middle", bold=True))
    ticks = _ticks(end)
    for time in ticks:
        anchor = "start" if time == 0 else "end" if scale * time > RunTimeline.WIDTH - 10 else "middle"
        words = f"{time:g}{' s' if time == 0 else ''}"
        texts.append(Text(scale * time, RunTimeline.BAR_TOP + RunTimeline.BAR_HEIGHT + 21, words, SOFT_INK, 12, anchor))
    marks = []
    last = -100.0
    for attempt in attempts:
        x = scale * (attempt["close_s"] if attempt["close_s"] is not None else attempt["launch_s"])
        marks.append(Mark(x, _MARKS.get(attempt["outcome"], _GREY), attempt["sentence"]))
        if x - last > 18.0:
            number = str(attempt["number"])
            words = f"attempt {number}: {attempt['outcome']}" if len(attempts) <= 3 else number
            anchor = "end" if x > 0.9 * RunTimeline.WIDTH else "start" if x < 0.1 * RunTimeline.WIDTH else "middle"
            texts.append(Text(x, RunTimeline.BAR_TOP - 16, words, INK, 13, anchor))
            last = x
    return RunTimeline(
        top=0 if attempts else RunTimeline.BAR_TOP - 4,
        blocks=tuple(blocks),
        ticks=tuple(scale * time for time in ticks),
        marks=tuple(marks),
        texts=tuple(texts),
        legend=_legend(spans),
    )


def _legend(spans: Sequence[PhaseSpan]) -> tuple[tuple[str, str, float], ...]:
    times: dict[IntEnum, float] = {}
    for span in spans:
        times[span.phase] = times.get(span.phase, 0.0) + span.end - span.start
    return tuple((phase_colour(phase), phase.name.lower(), time) for phase, time in sorted(times.items()))


def _ticks(end: float) -> list[float]:
    step = next(step for step in (0.5, 1, 2, 5, 10, 20, 60, 300, 1800, 7200) if end / step <= 14 or step == 7200)
    return [k * step for k in range(int(end / step) + 1)]
