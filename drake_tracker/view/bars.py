"""The autopsy as bars: what each stage contributed, largest first, beside what is normal."""

import math
from html import escape

from drake_tracker.autopsy.stages import WORDS

_ROOM = 1.02
"""The longest bar ends a little before the end of its track."""


def contribution_bars(size, normal, rows, ages=None, culprit=None):
    """Returns a table of HTML with a bar for each stage, the largest first.

    Args:
      size: {stage: length of its contribution [m]}. normal: {stage: what is normal [m]}. rows: {stage: (along, across,
      up [m], yaw [rad])}. ages: {stage: [s]}, or None for a table without milliseconds. culprit: name of the stage that
      is marked.
    """
    longest = _ROOM * max(*size.values(), *normal.values(), 1e-3)
    head = "<th></th><th></th><th>mm</th><th>along</th><th>across</th><th>up</th><th>turn</th>"
    lines = [f"<tr>{head}{'<th>ms</th>' if ages is not None else ''}</tr>"]
    for stage in sorted(size, key=lambda stage: -size[stage]):
        along, across, up, yaw = rows[stage]
        share, tick = 100.0 * size[stage] / longest, 100.0 * normal[stage] / longest
        kind = "bar worst" if stage == culprit else "bar"
        words = f"normal: up to {_mm(normal[stage])} mm"
        cells = (_mm(size[stage]), *(_signed(x) for x in (along, across, up)), _degrees(yaw))
        if ages is not None:
            cells += (_ms(ages.get(stage)),)
        lines.append(
            f'<tr><th scope="row">{escape(stage)}</th><td class="track"><div class="{kind}" style="width:{share:.1f}%">'
            f'</div><div class="normal" style="left:{tick:.1f}%" title="{words}"></div></td>'
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
    return f'<table class="bars">{"".join(lines)}</table>'


def by_word(values):
    """Returns numbers in the order of `Stage` as {stage's name: number}."""
    return {word: float(value) for word, value in zip(WORDS.values(), values)}


def _mm(length):
    return f"{1e3 * length:.1f}"


def _signed(length):
    return _without_sign_of_zero(f"{1e3 * length:+.1f}")


def _degrees(angle):
    return _without_sign_of_zero(f"{math.degrees(angle):+.0f}") + "°"


def _ms(age):
    return "" if age is None else _without_sign_of_zero(f"{1e3 * age:.0f}")


def _without_sign_of_zero(text):
    return text.lstrip("+-") if float(text) == 0.0 else text
