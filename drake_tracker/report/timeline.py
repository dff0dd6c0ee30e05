"""The phases of a run as a picture: a bar of colours over time, the attempts marked on it."""

from html import escape

from drake_tracker.tasks.style import INK, SOFT_INK, phase_colour

_WIDTH, _LEFT, _RIGHT = 1160, 0, 0
_BAR_TOP, _BAR, _HEIGHT = 34, 30, 92
_MARKS = {"lifted": "#009e73", "missed": "#d55e00", "dropped": "#cc79a7"}
_GREY = "#8a9099"


def timeline_svg(spans, attempts=()):
    """Returns an SVG of phases, `PhaseSpan`s, with a mark where the jaws of each attempt closed.

    ``attempts``: dicts as in `autopsy.perform`; of one whose jaws never closed the launch is marked.
    """
    if not spans:
        return ""
    end = max(spans[-1].end, 1e-3)
    top = 0 if attempts else _BAR_TOP - 4

    def at(time):
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * time / end

    parts = [
        f'<svg class="timeline" viewBox="0 {top} {_WIDTH} {_HEIGHT - top}" role="img" aria-label="phases over time">',
    ]
    for span in spans:
        x, width = at(span.start), max(at(span.end) - at(span.start), 0.5)
        name = span.phase.name.lower()
        words = f"{name}, {span.start:.2f} to {span.end:.2f} s"
        parts.append(
            f'<rect x="{x:.1f}" y="{_BAR_TOP}" width="{width:.1f}" height="{_BAR}" fill="{phase_colour(span.phase)}">'
            f"<title>{escape(words)}</title></rect>"
        )
        if width > 9.0 * len(name):
            parts.append(_text(x + 0.5 * width, _BAR_TOP + 20, name, "#ffffff", 13, "middle", bold=True))
    for time in _ticks(end):
        x = at(time)
        parts.append(f'<path d="M{x:.1f} {_BAR_TOP + _BAR}v6" stroke="{_GREY}"/>')
        anchor = "start" if time == 0 else "end" if x > _WIDTH - 10 else "middle"
        parts.append(_text(x, _BAR_TOP + _BAR + 21, f"{time:g}{' s' if time == 0 else ''}", SOFT_INK, 12, anchor))
    last = -100.0
    for attempt in attempts:
        x = at(attempt["close_s"] if attempt["close_s"] is not None else attempt["launch_s"])
        colour = _MARKS.get(attempt["outcome"], _GREY)
        parts.append(
            f'<path d="M{x:.1f} {_BAR_TOP - 2}l-6 -9h12z" fill="{colour}">'
            f"<title>{escape(attempt['sentence'])}</title></path>"
        )
        if x - last > 18.0:
            words = f"attempt {attempt['number']}: {attempt['outcome']}" if len(attempts) <= 3 else attempt["number"]
            anchor = "end" if x > 0.9 * _WIDTH else "start" if x < 0.1 * _WIDTH else "middle"
            parts.append(_text(x, _BAR_TOP - 16, words, INK, 13, anchor))
            last = x
    return "".join(parts) + "</svg>"


def phase_legend(spans):
    """Returns the phases of a run as a line of HTML: colour, name, and how long each took in all."""
    times = {}
    for span in spans:
        times[span.phase] = times.get(span.phase, 0.0) + span.end - span.start
    items = (
        f'<span><i style="background:{phase_colour(phase)}"></i>{phase.name.lower()} {time:.1f} s</span>'
        for phase, time in sorted(times.items())
    )
    return f'<p class="legend">{"".join(items)}</p>'


def _ticks(end):
    step = next(step for step in (0.5, 1, 2, 5, 10, 20, 60, 300, 1800, 7200) if end / step <= 14 or step == 7200)
    return [k * step for k in range(int(end / step) + 1)]


def _text(x, y, words, colour, size, anchor, bold=False):
    weight = ' font-weight="600"' if bold else ""
    return (
        f'<text x="{x:.1f}" y="{y}" fill="{colour}" font-size="{size}" text-anchor="{anchor}"{weight}>'
        f"{escape(str(words))}</text>"
    )
