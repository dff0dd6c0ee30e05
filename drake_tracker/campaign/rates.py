"""How often a campaign succeeded, cell by cell."""

from dataclasses import dataclass

from drake_tracker.campaign.grid import plain_value
from drake_tracker.campaign.wilson import wilson


@dataclass(frozen=True)
class Rate:
    """Of one cell: its settings {key path: YAML text}, trials that took the object, all trials, and the ends of the
    Wilson 95 % interval.
    """

    settings: dict
    taken: int
    trials: int
    low: float
    high: float

    @property
    def share(self):
        """The rate, from 0 to 1; None when there was no trial."""
        return self.taken / self.trials if self.trials else None


def rates_of(rows, cells):
    """Returns the `Rate` of each of the cells, a list of settings, from the lines of a record."""
    rates = []
    for settings in cells:
        successes = [bool(row["success"]) for row in rows if row["settings"] == settings]
        rates.append(Rate(settings, sum(successes), len(successes), *wilson(sum(successes), len(successes))))
    return rates


def overall(rates):
    """Returns the `Rate` of all cells together, with no settings."""
    taken, trials = sum(rate.taken for rate in rates), sum(rate.trials for rate in rates)
    return Rate({}, taken, trials, *wilson(taken, trials))


def rate_columns(rates, keys):
    """Returns the rates as a table {column: values, one a cell}, for a file."""
    columns = {key: [plain_value(rate.settings[key]) for rate in rates] for key in keys}
    columns |= {name: [getattr(rate, name) for rate in rates] for name in ("taken", "trials", "share")}
    return columns | {f"wilson_{name}": [getattr(rate, name) for rate in rates] for name in ("low", "high")}


def rate_table(rates, keys):
    """Returns the rates as lines of text in columns, in % with the Wilson 95 % interval, and that of all together."""
    rows = [[*keys, "taken", "trials", "%", "Wilson 95 %"]]
    rows += [[*(rate.settings[key] for key in keys), *_texts(rate)] for rate in rates]
    if len(rates) > 1:
        rows.append(["all", *[""] * (len(keys) - 1), *_texts(overall(rates))])
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip() for row in rows]


def _texts(rate):
    if not rate.trials:
        return ["0", "0", "", ""]
    return [str(rate.taken), str(rate.trials), f"{100 * rate.share:.0f}", f"{100 * rate.low:.0f}-{100 * rate.high:.0f}"]
