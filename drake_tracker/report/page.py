"""Writes the page of a run: HTML without scripts, whose links lead to the files beside it."""

from html import escape
from pathlib import Path

from drake_tracker.core.timing import BALL_TIME_STEP, TIME_STEP
from drake_tracker.grasp.catch_schema import CatchPhase
from drake_tracker.grasp.schema import Phase
from drake_tracker.report.autopsy.autopsy import perform
from drake_tracker.report.autopsy.normal import NORMAL_ATTEMPT, NORMAL_TRACKING
from drake_tracker.report.bars import by_word, contribution_bars
from drake_tracker.report.summary_table import summary_rows
from drake_tracker.report.timeline import phase_legend, timeline_svg
from drake_tracker.tasks.episode import phase_spans

CAPTIONS = {
    "tracking.png": "The track from above, errors over time, phases.",
    "ball_path.png": "The board from above: the ball's way, what was foreseen of it, the crossing and the cup.",
    "motion.png": "What the motion detector made of the images at one instant.",
    "board.png": "The initialisation's first image with what was found in it.",
}
"""The pictures of a run, in the order of the page."""


def page_of(run):
    """Returns the page, a text of HTML, of a `run_files.RunFiles`."""
    autopsy = _autopsy(run)
    title = f"{_name(run)}, seed {_seed(run)}"
    parts = [
        _header(run, title),
        _lead(run, autopsy),
        _notes(run),
        _media(run),
        _timeline(run, autopsy),
        _attempts(autopsy),
        _tracking(autopsy),
        _pictures(run),
        _numbers(run),
        _footer(run),
    ]
    css = (Path(__file__).parent / "page.css").read_text(encoding="utf-8")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">\n'
        f"<style>\n{css}</style></head>\n<body><main>\n"
        + "\n".join(part for part in parts if part)
        + "\n</main></body></html>\n"
    )


def _autopsy(run):
    """Returns the autopsy of a train's run, or None; a log of which it cannot be made is noted."""
    if run.task != "train" or run.log is None:
        return None
    if run.scenario is None:
        run.notes.append("Without a scenario that this version understands there is no autopsy.")
        return None
    try:
        return perform(run.scenario, run.log)
    except (KeyError, ValueError, IndexError) as error:
        run.notes.append(f"The log does not have what the autopsy needs ({error}).")
        return None


def _name(run):
    return (run.summary or {}).get("scenario") or (run.scenario.name if run.scenario is not None else run.folder.name)


def _seed(run):
    seed = (run.summary or {}).get("seed")
    return seed if seed is not None else run.scenario.seed if run.scenario is not None else "unknown"


def _header(run, title):
    success = (run.summary or {}).get("success")
    words = {"train": ("lifted", "not lifted"), "ball": ("caught", "not caught")}[run.task]
    kind, outcome = ("open", "no verdict") if success is None else ("good", words[0]) if success else ("bad", words[1])
    return (
        f'<header><h1>{escape(str(title))}</h1><span class="outcome {kind}">{outcome}</span>'
        f'<span class="sub">{escape(str(run.folder))}</span></header>'
    )


def _lead(run, autopsy):
    summary = run.summary or {}
    sentences = []
    if summary.get("failure_reason"):
        reason = str(summary["failure_reason"])
        sentences.append(reason[0].upper() + reason[1:] + ".")
    elif run.task == "ball" and summary.get("success"):
        sentences.append(tell_catch(summary))
    elif summary.get("success") and summary.get("time_to_grasp_s") is not None:
        count = summary.get("attempts")
        which = "at the first attempt" if count == 1 else f"at attempt {count}"
        sentences.append(f"The train was lifted {which}, {summary['time_to_grasp_s']:.1f} s after the start.")
    if autopsy is not None and autopsy["verdict"]:
        sentences.append(autopsy["verdict"])
    return "".join(f'<p class="lead">{escape(sentence)}</p>' for sentence in sentences)


def tell_catch(summary):
    """Returns the sentence on a run whose ball was caught, from its summary."""
    parts = ["The ball was caught"]
    if summary.get("roll_s") is not None and summary.get("exit_speed_m_s") is not None:
        left = f"{summary['roll_s']:.2f} s after its release at {summary['exit_speed_m_s']:.2f} m/s"
        parts.append(f"it left the board {left}")
    if summary.get("hand_error_m") is not None:
        parts.append(f"the middle of the cup was {1e3 * abs(summary['hand_error_m']):.0f} mm beside it")
    return f"{parts[0]}{': ' if parts[1:] else ''}{', and '.join(parts[1:])}."


def _notes(run):
    if not run.notes:
        return ""
    return f'<ul class="notes">{"".join(f"<li>{escape(note)}</li>" for note in run.notes)}</ul>'


def _media(run):
    figures = []
    if "recording.html" in run.names:
        figures.append(
            '<figure><iframe src="recording.html" title="recording" loading="lazy"></iframe>'
            '<figcaption>The scene. Drag to turn it, <a href="recording.html">open it alone</a>.</figcaption></figure>'
        )
    if "cameras.mp4" in run.names:
        figures.append(
            '<figure><video src="cameras.mp4" controls muted preload="metadata"></video>'
            "<figcaption>What the cameras saw, and what was made of it.</figcaption></figure>"
        )
    if not figures:
        return ""
    return f'<section><div class="media{" one" if len(figures) == 1 else ""}">{"".join(figures)}</div></section>'


def _timeline(run, autopsy):
    if run.log is None or "command" not in run.log:
        return ""
    if run.task == "ball":
        spans = phase_spans(run.log, BALL_TIME_STEP, CatchPhase)
    else:
        spans = phase_spans(run.log, TIME_STEP, Phase)
    if not spans:
        return ""
    attempts = autopsy["attempts"] if autopsy is not None else ()
    return f"<section><h2>Phases</h2>{timeline_svg(spans, attempts)}{phase_legend(spans)}</section>"


def _attempts(autopsy):
    if autopsy is None or not autopsy["attempts"]:
        return ""
    normal = by_word(NORMAL_ATTEMPT)
    parts = []
    for attempt in autopsy["attempts"]:
        bars = ""
        if "size_m" in attempt:
            bars = contribution_bars(
                attempt["size_m"], normal, attempt["contributions"], attempt["ages_s"], attempt["culprit"]
            )
        parts.append(f'<div class="attempt"><p>{escape(attempt["sentence"])}</p>{bars}</div>')
    return (
        f"<section><h2>{'Attempts' if len(parts) > 1 else 'The attempt'}: where the offset of the hand came from</h2>"
        + "".join(parts)
        + _key("Offsets of the hand from the train when the jaws closed, seen in its direction of travel; they add up.")
        + "</section>"
    )


def _tracking(autopsy):
    if autopsy is None or not autopsy["tracking"]["moments"]:
        return ""
    tracking = autopsy["tracking"]
    culprit = None if autopsy["verdict"] is None else autopsy["culprit"]
    sizes = {stage: size for stage, size in tracking["size_m"].items() if stage != "grasp timing"}
    ages = {"link": tracking["age_s"]}
    bars = contribution_bars(sizes, by_word(NORMAL_TRACKING), tracking["rms"], ages, culprit, signed=False)
    words = (
        f"Had the hand been sent down at any of {tracking['moments']} moments: 68 of 100 are within (mm), the rest are "
        "root mean squares."
    )
    return f"<section><h2>The same while tracking</h2>{bars}{_key(words)}</section>"


def _key(words):
    return (
        f'<p class="legend"><span>{words}</span><span><i class="tick"></i>the largest that is normal</span>'
        '<span><i style="background:#d55e00"></i>most beyond what is normal</span></p>'
    )


def _pictures(run):
    figures = [
        f'<figure><a href="{name}"><img src="{name}" alt="{escape(words)}"></a>'
        f"<figcaption>{escape(words)}</figcaption></figure>"
        for name, words in CAPTIONS.items()
        if name in run.names
    ]
    return f'<section><div class="pictures">{"".join(figures)}</div></section>' if figures else ""


def _numbers(run):
    rows = summary_rows(run.summary or {}, run.task)
    if not rows:
        return ""
    cells = "".join(f"<div><span>{escape(a)}</span><b>{escape(f'{b} {c}'.strip())}</b></div>" for a, b, c in rows)
    return f'<section><h2>Summary</h2><div class="numbers">{cells}</div></section>'


def _footer(run):
    files = ", ".join(f'<a href="{name}">{name}</a>' for name in run.names)
    summary = run.summary or {}
    versions = summary.get("package_versions") or {}
    made = ", ".join(f"{escape(str(name))} {escape(str(version))}" for name, version in versions.items() if version)
    return f"<footer>Files: {files}{f'<br>Made by {made}' if made else ''}</footer>"
