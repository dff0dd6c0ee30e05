"""The autopsy as bars: the contribution of each stage, largest first, beside what is normal."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drake_tracker.report.failure_diagnosis.stages import WORDS

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
