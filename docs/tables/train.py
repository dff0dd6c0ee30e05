"""Lifted trains, with rendered images in the loop (`results/train_grasp.jsonl`)."""

from result_tables.hard_path_tables import hard_paths_table
from train_grasp import (
    CELLS,
    ESTIMATORS,
    FIRST_SEED,
    PAPER_CELLS,
    RUNGS,
    SEEDS,
    cells_table,
    lifted,
    median_time,
    side_by_side_table,
)

from tables.headline import rung_rows
from tables.results import Row, block, commit_of, data, lines, listed, of, origin, seeds_between, table, uses, where

_GATED = "cast-shadows-gated"
_BY_CAST_SHADOWS = (_GATED, "cast-shadows")


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
    rows = where(lines("train_grasp"), scenario="train", seed=seeds_between(FIRST_SEED, FIRST_SEED + SEEDS - 1))
    rows = sorted((row for row in rows if row["cell"] in PAPER_CELLS), key=lambda row: PAPER_CELLS.index(row["cell"]))
    first = lifted(rows)[1]
    return block(
        table(*cells_table(rows)),
        origin(rows),
        f"In all nine conditions together, the arm lifted {of(first, len(rows), ' trains')} at the first attempt.",
    )


def _runs(estimator: str, first: int, last: int) -> list[Row]:
    rows = where(lines("train_grasp"), estimator=estimator, seed=seeds_between(first, last))
    return sorted(rows, key=lambda row: (list(CELLS).index(row["cell"]), row["seed"]))


def _main() -> list[Row]:
    """The closed path on seeds 500 to 519, every cell but those of cast shadows."""
    return _runs("closed_path", 500, 519)


def _gated() -> list[Row]:
    return where(_runs("closed_path", 300, 319), cell=_GATED)


def _of_1991() -> list[Row]:
    return [row for row in _runs("arc_length", 200, 219) if commit_of(row) == "31ef9bf"]


def train_cells() -> str:
    header, rows = cells_table(_main() + _gated())
    rows.append(["cast-shadows", 0, *[""] * (len(header) - 2)])
    main = origin(_main(), f"The cell `{_GATED}`: s{origin(_gated())[2:-1]}")
    return block(table(header, rows), main)


def train_cells_summary() -> str:
    return f"Without the cells of cast shadows, {_lifted(_main())}"


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


def train_estimators() -> str:
    rows = [row for name in ESTIMATORS for row in _runs(name, 500, 502) if row["cell"] not in _BY_CAST_SHADOWS]
    rows.sort(key=lambda row: list(CELLS).index(row["cell"]))
    return block(table(*side_by_side_table(rows, list(ESTIMATORS))), origin(rows))


def train_estimators_failures() -> str:
    rows = [row for name in ESTIMATORS for row in _runs(name, 500, 502)]
    failed = [row["failure_reason"] for row in rows if not row["success"]]
    shut = [reason for reason in failed if reason.startswith("the gate never opened")]
    all_shut = "all" if len(shut) == len(failed) else len(shut)
    causes = {text: sum(text in reason for reason in shut) for text in ("earlier predictions", "the jaws were turning")}
    untrue, turning = causes.values()
    later = sum(bool(row["success"]) and not row["first_attempt_success"] for row in rows)
    return (
        f"Of {len(rows)} runs {len(failed)} failed, {all_shut} of them because the launch gate did not open within the "
        f"minute. The main reason was in {untrue} runs that earlier predictions from the same place had not come true, "
        f"in {turning} that the jaws were turning over. {later or 'No'} train was lifted at a later attempt."
    )


def train_shadows() -> str:
    counts = []
    for rows in (_gated(), where(_of_1991(), cell=_GATED), where(_of_1991(), cell="cast-shadows")):
        counts.append((lifted(rows)[0], len(rows)))
    return (
        f"With the brightness gate, the closed path lifted {of(*counts[0], ' trains')} and the filter of 1991 "
        f"{of(*counts[1])}. Without the gate, the filter of 1991 lifted {counts[2][0]} of {counts[2][1]}."
    )


def _lifted(rows: list[Row]) -> str:
    total, first = lifted(rows)
    attempts = "all" if first == total else f"{first} of them"
    return f"the arm lifted {of(total, len(rows), ' trains')}, {attempts} at the first attempt."
