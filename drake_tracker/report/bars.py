"""The autopsy as bars: what each stage contributed, largest first, beside what is normal."""

import math
from html import escape

from drake_tracker.report.autopsy.stages import WORDS

_ROOM = 1.02
"""The longest bar ends a little before the end of its track."""


def contribution_bars(size, normal, rows, ages, culprit=None, signed=True):
    """Returns a table of HTML with a bar for each stage, the largest first.

    Args:
      size: {stage: length of its contribution [m]}. normal: {stage: what is normal [m]}. rows: {stage: (along, across,
      up [m], yaw [rad])}, without signs unless they are ``signed``. ages: {stage: [s]}. culprit: name of the stage that
      is marked.
    """
    longest = _ROOM * max(*size.values(), *normal.values(), 1e-3)
    columns = ("", "", "mm", "along", "across", "up", "turn", "ms")
    lines = [f"<tr>{''.join(f'<th>{name}</th>' for name in columns)}</tr>"]
    for stage in sorted(size, key=lambda stage: -size[stage]):
        along, across, up, yaw = rows[stage]
        share, tick = 100.0 * size[stage] / longest, 100.0 * normal[stage] / longest
        kind = "bar worst" if stage == culprit else "bar"
        words = f"normal: up to {_mm(normal[stage])} mm"
        parts = [_signed(f"{1e3 * x:+.1f}") for x in (along, across, up)] + [_signed(f"{math.degrees(yaw):+.0f}") + "°"]
        cells = (_mm(size[stage]), *(part if signed else part.lstrip("+") for part in parts), _ms(ages.get(stage)))
        lines.append(
            f'<tr><th scope="row">{escape(stage)}</th><td class="track"><div>'
            f'<div class="{kind}" style="width:{share:.1f}%"></div>'
            f'<div class="normal" style="left:{tick:.1f}%" title="{words}"></div></div></td>'
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
    return f'<table class="bars">{"".join(lines)}</table>'


def by_word(values):
    """Returns numbers in the order of `Stage` as {stage's name: number}."""
    return {word: float(value) for word, value in zip(WORDS.values(), values)}


def _mm(length):
    return f"{1e3 * length:.1f}"


def _ms(age):
    return "" if age is None else _signed(f"{1e3 * age:.0f}")


def _signed(text):
    """Returns a number as it is written, but for the sign of a zero."""
    return text.lstrip("+-") if float(text) == 0.0 else text
