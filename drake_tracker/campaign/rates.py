"""The success rates of a campaign, cell by cell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import erf, sqrt
from typing import Any

from drake_tracker.campaign.grid import plain_value

Z_95 = 1.959964
"""Quantile of the standard normal distribution that leaves 2.5 % above it, as tables print it."""
CONFIDENCE = erf(Z_95 / sqrt(2.0))
"""Confidence level of the interval: 95 %, as far as `Z_95` is."""


@dataclass(frozen=True)
class Rate:
    """The success rate of one cell.

    Attributes:
        settings: {key path: YAML text} of the cell.
        successes: number of trials in which the object was grasped or caught.
        trials: number of all trials.
        low: lower end of the 95 % Wilson interval.
        high: upper end of the 95 % Wilson interval.
    """

    settings: Mapping[str, str]
    successes: int
    trials: int
    low: float
    high: float

    @property
    def share(self) -> float | None:
        """The rate, from 0 to 1; None when there was no trial."""
        return self.successes / self.trials if self.trials else None


def rates_of(rows: Sequence[Mapping[str, Any]], cells: Sequence[Mapping[str, str]]) -> list[Rate]:
    """Returns the `Rate` of each cell."""
    rates = []
    for settings in cells:
        found = [bool(row["success"]) for row in rows if row["settings"] == settings]
        rates.append(Rate(settings, sum(found), len(found), *wilson(sum(found), len(found))))
    return rates


def overall(rates: Sequence[Rate]) -> Rate:
    """Returns the `Rate` of all cells together, with no settings."""
    successes, trials = sum(rate.successes for rate in rates), sum(rate.trials for rate in rates)
    return Rate({}, successes, trials, *wilson(successes, trials))


def rate_columns(rates: Sequence[Rate], keys: Sequence[str]) -> dict[str, list[Any]]:
    """Returns the rates as a table for a file: {column: values}, with one row for each cell."""
    return {
        **{key: [plain_value(rate.settings[key]) for rate in rates] for key in keys},
        "taken": [rate.successes for rate in rates],
        "trials": [rate.trials for rate in rates],
        "share": [rate.share for rate in rates],
        "wilson_low": [rate.low for rate in rates],
        "wilson_high": [rate.high for rate in rates],
    }


def rate_table(rates: Sequence[Rate], keys: Sequence[str]) -> list[str]:
    """Returns the rates as lines of text: counts, percentage, 95 % Wilson interval; last the overall rate."""
    rows = [[*keys, "successes", "trials", "%", "Wilson 95 %"]]
    rows += [[*(rate.settings[key] for key in keys), *_texts(rate)] for rate in rates]
    if len(rates) > 1:
        rows.append(["all", *[""] * (len(keys) - 1), *_texts(overall(rates))])
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip() for row in rows]


def _texts(rate: Rate) -> list[str]:
    if rate.share is None:
        return ["0", "0", "", ""]
    interval = f"{100 * rate.low:.0f}-{100 * rate.high:.0f}"
    return [str(rate.successes), str(rate.trials), f"{100 * rate.share:.0f}", interval]


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Returns the 95 % Wilson interval (low, high) of a success rate; (0, 1) when there was no trial.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of the American
    Statistical Association 22 (1927): the rates for which the observed count is at most `Z_95` standard deviations from
    the expected one.
    """
    from scipy.stats import binomtest  # slow to load

    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)
