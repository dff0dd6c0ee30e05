"""Makes the page of a run: HTML without scripts, with links to the files beside it.

The templates are in the folder ``templates``. Jinja2 escapes everything that they insert.
"""

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, TypeVar

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.report.failure_diagnosis.diagnosis import perform
from drake_tracker.report.failure_diagnosis.stages import NORMAL_ATTEMPT, NORMAL_TRACKING, WORDS, Stage
from drake_tracker.report.run_files import RunFiles, first_line
from drake_tracker.report.summary_table import summary_rows
from drake_tracker.report.timeline import RunTimeline, make_timeline
from drake_tracker.report.tracks_section import make_tracks_section
from drake_tracker.scenarios.base import Custom

_Part = TypeVar("_Part")
MOTION_CAPTION = "Result of the motion detection in the images of one instant."
_MARGIN = 1.02
"""Length of a bar's track over the length of the longest bar."""


@dataclass(frozen=True)
class Bar:
    """One row of the table of bars.

    Attributes:
        stage: name of the stage.
        width: length of the bar [% of its track].
        normal: position of the mark of the normal size [% of the track].
        hint: text on the mark.
        is_culprit: whether the stage is marked.
        cells: texts of the columns: mm, along, across, up, turn, ms.
    """

    stage: str
    width: float
    normal: float
    hint: str
    is_culprit: bool
    cells: tuple[str, ...]


@dataclass(frozen=True)
class AttemptSection:
    """One attempt on the page.

    Attributes:
        sentence: on the attempt.
        bars: contributions of the stages; empty where the log does not tell.
    """

    sentence: str
    bars: list[Bar]


@dataclass(frozen=True)
class TrackingSection:
    """The contributions while tracking.

    Attributes:
        moments: number of moments that were evaluated.
        bars: contributions of the stages.
    """

    moments: int
    bars: list[Bar]


def page_of(run: RunFiles) -> str:
    """Returns the page of a run as a text of HTML. Adds to the notes of the run when there is no autopsy."""
    autopsy = _autopsy(run)
    timeline = _guarded(run, "The phases cannot be shown", lambda: _timeline(run, autopsy))
    captions = {**run.task.pictures, "motion.png": MOTION_CAPTION}
    page = (
        _templates()
        .get_template("page.html")
        .render(
            css=Markup((files("drake_tracker.report") / "page.css").read_text("utf-8")),  # a file of this package
            title=f"{_name(run)}, seed {_seed(run)}",
            outcome=_outcome(run),
            folder=str(run.folder),
            lead=_lead(run, autopsy),
            notes=run.notes,
            names=run.names,
            timeline=timeline,
            attempts=_attempts(autopsy),
            tracking=_tracking(autopsy),
            tracks=_guarded(run, "The tracks cannot be shown", lambda: make_tracks_section(run.log or {})),
            lost=((run.summary or {}).get("lost_parts") or {}).get("sentences", ()),
            troubles=((run.summary or {}).get("tracking") or {}).get("sentences", ()),
            pictures={name: caption for name, caption in captions.items() if name in run.names},
            rows=summary_rows(run.summary or {}, run.task.summary_rows),
            versions={name: version for name, version in _versions(run).items() if version},
        )
    )
    return page.encode("utf-8", "replace").decode("utf-8")  # a file may contain text that UTF-8 does not allow


@cache
def _templates() -> Environment:
    return Environment(
        loader=PackageLoader("drake_tracker.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _autopsy(run: RunFiles) -> dict[str, Any] | None:
    """Returns the autopsy of a run, or None when there is none; why it cannot be made is noted."""
    if not run.task.has_autopsy or run.log is None:
        return None
    if run.scenario is None:
        run.notes.append("There is no autopsy, because the scenario cannot be read.")
        return None
    if isinstance(run.scenario.arm, Custom):
        call = run.scenario.arm.call
        run.notes.append(
            f"There is no autopsy, because it needs the arm {call}, and viewing runs no code of a scenario."
        )
        return None
    scenario, log = run.scenario, run.log
    return _guarded(run, "There is no autopsy", lambda: perform(scenario, log))


def _guarded(run: RunFiles, consequence: str, make: Callable[[], _Part | None]) -> _Part | None:
    """Returns a part of the page, or None with a note when the log does not suffice for it."""
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return make()
    except DrakeTrackerError as error:
        run.notes.append(f"{consequence}: {first_line(error)}.")
        return None
    except Exception as error:  # a log may have any numbers; the other parts of the page are shown
        run.notes.append(f"{consequence}, because the log lacks data that it needs ({first_line(error)}).")
        return None


def _name(run: RunFiles) -> str:
    name = (run.summary or {}).get("scenario") or (run.scenario.name if run.scenario is not None else run.folder.name)
    return str(name)


def _seed(run: RunFiles) -> str:
    seed = (run.summary or {}).get("seed")
    if seed is None:
        seed = run.scenario.seed if run.scenario is not None else "unknown"
    return str(seed)


def _outcome(run: RunFiles) -> tuple[str, str]:
    """Returns (CSS class, words) of the outcome of a run."""
    success = (run.summary or {}).get("success")
    if success is None:
        return "open", "no verdict"
    return "good" if success else "bad", run.task.outcomes[bool(success)]


def _lead(run: RunFiles, autopsy: dict[str, Any] | None) -> list[str]:
    """Returns the sentences with which the page begins."""
    summary = run.summary or {}
    sentences: list[str | None] = []
    if summary.get("failure_reason"):
        reason = str(summary["failure_reason"])
        sentences.append(reason[0].upper() + reason[1:] + ".")
    elif summary.get("success"):
        sentences.append(run.task.success_sentence(summary))
    if autopsy is not None:
        sentences.append(autopsy["verdict"])
    return [sentence for sentence in sentences if sentence]


def _timeline(run: RunFiles, autopsy: dict[str, Any] | None) -> RunTimeline | None:
    if run.log is None or "command" not in run.log:
        return None
    time_step = run.task.time_step if run.scenario is None else run.scenario.time_step
    spans = run.task.phase_spans(run.log, time_step)
    return make_timeline(spans, autopsy["attempts"] if autopsy is not None else ()) if spans else None


def _attempts(autopsy: dict[str, Any] | None) -> list[AttemptSection]:
    if autopsy is None:
        return []
    sections = []
    for attempt in autopsy["attempts"]:
        bars = []
        if "size_m" in attempt:
            bars = contribution_bars(
                attempt["size_m"],
                by_word(NORMAL_ATTEMPT),
                attempt["contributions"],
                attempt["ages_s"],
                attempt["culprit"],
            )
        sections.append(AttemptSection(attempt["sentence"], bars))
    return sections


def _tracking(autopsy: dict[str, Any] | None) -> TrackingSection | None:
    if autopsy is None or not autopsy["tracking"]["moments"]:
        return None
    tracking = autopsy["tracking"]
    bars = contribution_bars(
        {stage: size for stage, size in tracking["size_m"].items() if stage != WORDS[Stage.TIMING]},
        by_word(NORMAL_TRACKING),
        tracking["rms"],
        {WORDS[Stage.LINK]: tracking["age_s"]},
        None if autopsy["verdict"] is None else autopsy["culprit"],
        signed=False,
    )
    return TrackingSection(tracking["moments"], bars)


def _versions(run: RunFiles) -> dict[str, Any]:
    return (run.summary or {}).get("package_versions") or {}


def contribution_bars(
    size: Mapping[str, float],
    normal: Mapping[str, float],
    rows: Mapping[str, Sequence[float]],
    ages: Mapping[str, float | None],
    culprit: str | None = None,
    signed: bool = True,
) -> list[Bar]:
    """Returns a `Bar` for each stage, the largest first.

    Args:
        size: {stage: length of its contribution [m]}.
        normal: {stage: normal length [m]}.
        rows: {stage: (along, across, up [m], yaw [rad])}.
        ages: {stage: [s]}.
        culprit: name of the stage that is marked, or None.
        signed: whether the rows have signs.
    """
    longest = _MARGIN * max(*size.values(), *normal.values(), 1e-3)
    bars = []
    for stage in sorted(size, key=lambda stage: -size[stage]):
        along, across, up, yaw = rows[stage]
        parts = [_number(f"{1e3 * x:+.1f}") for x in (along, across, up)]
        parts.append(_number(f"{math.degrees(yaw):+.0f}") + "°")
        if not signed:
            parts = [part.lstrip("+") for part in parts]
        bars.append(
            Bar(
                stage=stage,
                width=100.0 * size[stage] / longest,
                normal=100.0 * normal[stage] / longest,
                hint=f"normal: up to {_mm(normal[stage])} mm",
                is_culprit=stage == culprit,
                cells=(
                    _mm(size[stage]),
                    *parts,
                    _ms(ages.get(stage)),
                ),
            )
        )
    return bars


def by_word(values: Sequence[float]) -> dict[str, float]:
    """Returns numbers in the order of `Stage` as {name of the stage: number}."""
    return {word: float(value) for word, value in zip(WORDS.values(), values)}


def _mm(length: float) -> str:
    return f"{1e3 * length:.1f}"


def _ms(age: float | None) -> str:
    return "" if age is None else _number(f"{1e3 * age:.0f}")


def _number(text: str) -> str:
    """Returns a formatted number without the sign of a zero."""
    return text.lstrip("+-") if float(text) == 0.0 else text
