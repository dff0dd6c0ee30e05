"""Lifted trains, with rendered images in the loop (`results/train_grasp.jsonl`)."""

from collections import Counter

from result_tables.hard_path_tables import hard_paths_table
from train_grasp import (
    CELLS,
    ESTIMATORS,
    FIRST_SEED,
    PAPER_CELLS,
    RUNGS,
    SEEDS,
    cells_table,
    is_rung,
    lifted,
    median_time,
    side_by_side_table,
)

from tables.headline import CONDITIONS, rung_rows
from tables.results import Row, block, data, lines, listed, of, origin, seeds_between, table, uses, where


def hard_paths() -> str:
    rows = lines("hard_paths")
    tracks = [track for kind in data("crossing_tracks")["tracks"].values() for track in kind]
    jumped = sum(track["jumps"] > 0 for track in tracks)
    crossing = f"The train left its branch on {of(jumped, len(tracks), ' tracks')} that cross or touch themselves."
    return block(
        table(*hard_paths_table(rows)), origin(rows, "Development used these tracks, with other seeds."), crossing
    )


def train_rungs() -> str:
    runs = {scenario: rung_rows(scenario) for scenario in RUNGS}
    cells = sorted({row["cell"] for rows in runs.values() for row in rows}, key=list(CELLS).index)
    body = []
    for cell in cells:
        shown = []
        for rows in runs.values():
            own = where(rows, cell=cell)
            shown.append(f"{lifted(own)[1]} of {len(own)}, {median_time(own) or 'none'}" if own else "")
        body.append([cell, *shown])
    totals = [f"{lifted(rows)[1]} of {len(rows)}, {median_time(rows)}" for rows in runs.values()]
    header = ["first attempt, median time", *(f"`{scenario}`" for scenario in RUNGS)]
    return block(table(header, [*body, ["all", *totals]]), origin([row for rows in runs.values() for row in rows]))


def train_rungs_failures() -> str:
    runs = [row for scenario in RUNGS for row in rung_rows(scenario)]
    uses(*runs)
    rows = [row for row in runs if not row["first_attempt_success"]]
    if not rows:
        return "All trains were lifted at the first attempt."
    return table(
        ["scenario", "cell", "seed", "outcome"],
        [
            [
                f"`{row['scenario']}`",
                row["cell"],
                row["seed"],
                row["failure_reason"] or f"lifted at attempt {row['attempts']}",
            ]
            for row in rows
        ],
    )


def train_paper() -> str:
    seeds = seeds_between(FIRST_SEED, FIRST_SEED + SEEDS - 1)
    rows = where(lines("train_grasp"), scenario="train", seed=seeds, cell=PAPER_CELLS.__contains__)
    rows = sorted(filter(is_rung, rows), key=lambda row: PAPER_CELLS.index(row["cell"]))
    first = lifted(rows)[1]
    return block(
        table(*cells_table(rows)),
        origin(rows),
        f"In all nine conditions together, the arm lifted {of(first, len(rows), ' trains')} at the first attempt.",
    )


def train_limits() -> str:
    body, used = [], []
    for scenario in RUNGS:
        rows = rung_rows(scenario)
        used += rows
        body.append(
            [
                f"`{scenario}`",
                len(rows),
                f"{min(row['joint_limit_margin_rad'] for row in rows):.3f} rad",
                f"{100 * max(row['speed_share'] for row in rows):.1f} %",
                f"{1e3 * max(row['longest_saturation_s'] for row in rows):.0f} ms",
                sum(row["table_touched"] for row in rows),
            ]
        )
    header = ["scenario", "runs", "smallest distance to a joint limit", "largest joint speed, of the rated speed"]
    return block(
        table([*header, "longest saturation of a drive", "runs in which the table was touched"], body), origin(used)
    )


def train_lag() -> str:
    rows = lines("train_grasp")
    values = sorted({1e3 * row["lag_s"][end] for row in rows for end in ("min", "max")})
    shown = listed([f"{value:.2f}" for value in values])
    return f"[The time from image to prediction](index.md#what-a-number-means) was {shown} ms in all {len(rows)} runs."


def _of_estimators() -> list[Row]:
    """Returns the runs of all estimators with the seeds that each of them has run in each condition."""
    rows = where(lines("train_grasp"), scenario=("train", "train:learned").__contains__, cell=CONDITIONS.__contains__)
    runs = Counter(row["seed"] for row in rows)
    found = [row for row in rows if runs[row["seed"]] == len(ESTIMATORS) * len(CONDITIONS)]
    return sorted(found, key=lambda row: CONDITIONS.index(row["cell"]))


def train_estimators() -> str:
    rows = _of_estimators()
    return block(table(*side_by_side_table(rows, list(ESTIMATORS))), origin(rows))


def train_estimators_failures() -> str:
    rows = _of_estimators()
    uses(*rows)
    missed = [row for row in rows if not row["first_attempt_success"]]
    shut = sum("the gate never opened" in (row["failure_reason"] or "") for row in missed)
    share = "all" if shut == len(missed) else f"{shut}"
    return (
        f"{len(missed)} of {len(rows)} runs did not lift the train at the first attempt. In {share} of them, the "
        "launch gate did not open within the minute."
    )


def _shadows(estimator: str, cell: str) -> list[Row]:
    return where(lines("train_grasp"), estimator=estimator, cell=cell)


def train_shadows() -> str:
    gated, shaded = "cast-shadows-gated", "cast-shadows"
    runs = (_shadows("closed_path", gated), _shadows("arc_length", gated), _shadows("arc_length", shaded))
    uses(*(row for rows in runs for row in rows))
    counts = [(lifted(rows)[0], len(rows)) for rows in runs]
    return (
        f"With the brightness gate, the closed path lifted {of(*counts[0], ' trains')} and the filter of 1991 "
        f"{of(*counts[1])}. Without the gate, the filter of 1991 lifted {counts[2][0]} of {counts[2][1]}."
    )
