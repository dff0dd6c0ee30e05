"""From lines of results to numbers: rms over runs with bootstrap intervals, and the table."""

import numpy as np
from measure import COLUMNS, HORIZONS

DRAWS = 2000
"""Of the bootstrap over runs."""


class Cell:
    """All runs of one cell. Each run counts the same; a root mean square is that over runs of their mean squares."""

    def __init__(self, lines):
        self.lines = sorted(lines, key=lambda line: line["seed"])

    def names(self):
        return list(dict.fromkeys(name for line in self.lines for name in line["results"]))

    def values(self, name, stages, horizon, column):
        """Returns one number for each run (runs,), NaN where there is none; weighed by n over several ``stages``."""
        found, place = [], COLUMNS.index(column)
        for line in self.lines:
            rows = [line["results"].get(name, {}).get(stage, {}).get(horizon) for stage in stages]
            rows = [(row[0], row[place]) for row in rows if row and row[place] is not None]
            found.append(np.average([v for _, v in rows], weights=[n for n, _ in rows]) if rows else np.nan)
        return np.array(found)

    def bound(self, kind, horizon):
        """Returns the bound's mean square [mm^2] of each run (runs,), NaN where there is none."""
        place = list(HORIZONS).index(horizon)
        return np.array([line["bounds"].get(kind, [np.nan] * 2)[place] for line in self.lines])

    def rms(self, name, stages, horizon, column="mean_square_mm2"):
        return root_mean(self.values(name, stages, horizon, column))

    def ratio(self, name, other, stages, horizon):
        """Returns (ratio of two contestants' rms, its 95 % interval), paired by run."""
        return paired_ratio(*(self.values(n, stages, horizon, "mean_square_mm2") for n in (name, other)))


MADE_BY = ("only", "commit", "python", "numpy", "scipy", "stonesoup", "filterpy")
"""What a line says of its making; ``only``: the one contestant that it is of, or None."""


def merged(lines):
    """Returns one line for each run: what a later line says of a contestant, or of a trial, takes the earlier's place.
    ``made_by`` lists what made it, a dict for each part."""
    runs = {}
    for line in lines:
        run = runs.setdefault((line["cell"], line["seed"]), {"made_by": []})
        made = {key: line.get(key) for key in MADE_BY}
        run["made_by"] = [other for other in run["made_by"] if other["only"] != line.get("only")] + [made]
        if "results" in line:
            run["results"] = run.get("results", {}) | line["results"]
        run |= {key: line[key] for key in ("cell", "seed", "trial", "bounds") if key in line}
    return list(runs.values())


def root_mean(squares):
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(np.mean(squares))) if len(squares) else float("nan")


def resample(count):
    return np.random.default_rng(0).integers(0, count, (DRAWS, count))


def interval(values, of=lambda drawn: np.sqrt(np.mean(drawn, axis=1))):
    """Returns the bootstrap 95 % interval over runs of ``of`` (drawn (draws, runs)) -> (draws,)."""
    values = values[np.isfinite(values)]
    if len(values) < 2:
        return float("nan"), float("nan")
    return tuple(float(edge) for edge in np.percentile(of(values[resample(len(values))]), [2.5, 97.5]))


def paired_ratio(squares, others):
    """Returns (root of the ratio of means, its 95 % interval (low, high)) of two arrays (runs,) paired by run."""
    both = np.isfinite(squares) & np.isfinite(others)
    if not both.any():
        return float("nan"), (float("nan"), float("nan"))
    squares, others = squares[both], others[both]
    index = resample(len(squares))
    drawn = np.sqrt(squares[index].mean(axis=1) / others[index].mean(axis=1))
    edges = tuple(float(edge) for edge in np.percentile(drawn, [2.5, 97.5]))
    return float(np.sqrt(squares.mean() / others.mean())), edges


def cells_of(lines):
    """Returns a dict from a cell's name to its `Cell`, in the order of ``lines``."""
    grouped = {}
    for line in lines:
        if "results" in line:
            grouped.setdefault(line["cell"], []).append(line)
    return {name: Cell(of_it) for name, of_it in grouped.items()}


def table_rows(cells):
    """Returns one dict for each cell, contestant, stage and horizon."""
    rows = []
    for cell_name, cell in cells.items():
        for name in cell.names():
            for stage in ("first", "after"):
                for horizon in HORIZONS:
                    squares = cell.values(name, [stage], horizon, "mean_square_mm2")
                    if not np.isfinite(squares).any():
                        continue
                    p95, inside = (cell.values(name, [stage], horizon, column) for column in ("p95_mm", "inside"))
                    low, high = interval(squares)
                    mean_of = lambda drawn: np.mean(drawn, axis=1)  # noqa: E731
                    rows.append(
                        {
                            "cell": cell_name,
                            "contestant": name,
                            "stage": stage,
                            "horizon": horizon,
                            "runs": int(np.isfinite(squares).sum()),
                            "rms_mm": root_mean(squares),
                            "rms_mm_interval": [low, high],
                            "p95_mm": float(np.nanmean(p95)),
                            "p95_mm_interval": list(interval(p95, mean_of)),
                            "heading_rms_deg": cell.rms(name, [stage], horizon, "heading_mean_square_deg2"),
                            "inside": float(np.nanmean(inside)) if np.isfinite(inside).any() else None,
                        }
                    )
    return rows


def print_rows(rows):
    """Prints one line for each cell, contestant and stage, both horizons beside each other."""
    columns = ("rms (interval) [mm]", "95th percentile", "heading [deg]", "within std")
    header = ["cell", "contestant", "stage", "runs"]
    header += [f"{horizon}: {text}" for horizon in HORIZONS for text in columns]
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * 12)
    pairs = {}
    for row in rows:
        pairs.setdefault((row["cell"], row["contestant"], row["stage"]), {})[row["horizon"]] = row
    for (cell, name, stage), pair in pairs.items():
        texts = [cell, name, stage, str(pair["present"]["runs"])]
        for horizon in HORIZONS:
            row = pair[horizon]
            low, high = row["rms_mm_interval"]
            inside = "" if row["inside"] is None else f"{row['inside']:.0%}"
            texts += [
                f"{row['rms_mm']:.2f} ({low:.2f}-{high:.2f})",
                f"{row['p95_mm']:.2f}",
                f"{row['heading_rms_deg']:.2f}",
                inside,
            ]
        print("| " + " | ".join(texts) + " |")
    print(flush=True)
